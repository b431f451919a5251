//! Fill-reducing order of a matrix made of dense node blocks.

use super::{SparseError, SymmetricPattern};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Approximate minimum degree order of the nodes of a block matrix, expanded to its rows.
///
/// `nodes` is the pattern of the node graph (lower triangle), `block` the rows per node. Ordering the small node graph
/// instead of the rows costs `block`^2 less and keeps the rows of a node together, which makes wide supernodes.
/// Returns the permutation `p`: row `p[k]` of the matrix is eliminated as the k-th.
///
/// # Errors
/// [`SparseError::Analysis`] when memory runs out.
pub fn block_order(nodes: &SymmetricPattern, block: usize) -> Result<Vec<usize>, SparseError> {
    let n = nodes.len();
    let analysis = |e: &dyn std::fmt::Debug| SparseError::Analysis(format!("{e:?}"));
    // AMD wants the pattern as an upper triangle or full; the transpose of the lower triangle is the upper one.
    let (col_ptr, row_idx) = nodes.transposed();
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &col_ptr, None, &row_idx);
    let mut forward = vec![0usize; n];
    let mut inverse = vec![0usize; n];
    let mut memory = MemBuffer::try_new(amd::order_scratch::<usize>(n, row_idx.len())).map_err(|e| analysis(&e))?;
    amd::order(&mut forward, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut memory))
        .map_err(|e| analysis(&e))?;
    Ok(forward.iter().flat_map(|&node| (0..block).map(move |k| node * block + k)).collect())
}
