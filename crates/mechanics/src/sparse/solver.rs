//! The solver: analysis, factorisation, solve.

use super::SparseError;
use super::substitution::{Panels, Real};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Pattern of the lower triangle of a symmetric matrix, by columns; each column starts with its diagonal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SymmetricPattern {
    col_ptr: Vec<usize>,
    row_idx: Vec<usize>,
}

impl SymmetricPattern {
    /// Takes column starts (n + 1) and row indices.
    ///
    /// # Errors
    /// [`SparseError::Pattern`] if a column is not sorted, does not start with the diagonal, or names a row above n - 1.
    pub fn new(col_ptr: Vec<usize>, row_idx: Vec<usize>) -> Result<Self, SparseError> {
        let n = col_ptr.len().saturating_sub(1);
        for column in 0..n {
            let rows = row_idx.get(col_ptr[column]..col_ptr[column + 1]).unwrap_or(&[]);
            let sorted = rows.windows(2).all(|w| w[0] < w[1]) && rows.iter().all(|&r| r < n);
            if rows.first() != Some(&column) || !sorted {
                return Err(SparseError::Pattern { column });
            }
        }
        Ok(Self { col_ptr, row_idx })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.col_ptr.len().saturating_sub(1)
    }

    /// True for the 0 x 0 matrix.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Column starts, length n + 1.
    pub fn col_ptr(&self) -> &[usize] {
        &self.col_ptr
    }

    /// Row indices, ascending in each column.
    pub fn row_idx(&self) -> &[usize] {
        &self.row_idx
    }

    /// Column starts and row indices of the upper triangle.
    pub(super) fn transposed(&self) -> (Vec<usize>, Vec<usize>) {
        let n = self.len();
        let mut col_ptr = vec![0usize; n + 1];
        for &r in &self.row_idx {
            col_ptr[r + 1] += 1;
        }
        for i in 0..n {
            col_ptr[i + 1] += col_ptr[i];
        }
        let mut next = col_ptr.clone();
        let mut row_idx = vec![0usize; self.row_idx.len()];
        for column in 0..n {
            for &r in &self.row_idx[self.col_ptr[column]..self.col_ptr[column + 1]] {
                row_idx[next[r]] = column;
                next[r] += 1;
            }
        }
        (col_ptr, row_idx)
    }
}

/// Number format of the factor. Single precision halves the memory a solve streams; it serves as an iteration matrix
/// (quasi-Newton), not for a direct answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// f64 factor.
    Double,
    /// f32 factor.
    Single,
}

enum Factor {
    Double { values: Vec<f64>, panels: Option<Panels<f64>> },
    Single { values: Vec<f32>, panels: Option<Panels<f32>>, entries: Vec<f32>, rhs: Vec<f32> },
}

/// A symmetric sparse system with kept analysis.
///
/// Order of calls: [`new`](Self::new), then [`factor`](Self::factor) whenever the matrix changed, then any number of
/// [`solve_in_place`](Self::solve_in_place). After a failed `factor` the solver holds no usable factor.
pub struct SymmetricSolver {
    pattern: SymmetricPattern,
    symbolic: SymbolicCholesky<usize>,
    factor: Factor,
    memory: MemBuffer,
    ready: bool,
}

impl std::fmt::Debug for SymmetricSolver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SymmetricSolver").field("rows", &self.pattern.len()).field("entries", &self.entries()).finish()
    }
}

impl SymmetricSolver {
    /// Analyses a pattern. `order`: elimination order (row `order[k]` is eliminated as the k-th), or none for approximate
    /// minimum degree.
    ///
    /// # Errors
    /// [`SparseError::Analysis`] when memory runs out or `order` is no permutation.
    pub fn new(pattern: SymmetricPattern, order: Option<&[usize]>, precision: Precision) -> Result<Self, SparseError> {
        let n = pattern.len();
        let shape = SymbolicSparseColMatRef::new_checked(n, n, &pattern.col_ptr, None, &pattern.row_idx);
        let inverse = order.map(|p| inverse(p, n)).transpose()?;
        let ordering = match (order, &inverse) {
            (Some(p), Some(inv)) => SymmetricOrdering::Custom(PermRef::new_checked(p, inv, n)),
            _ => SymmetricOrdering::Amd,
        };
        let symbolic = factorize_symbolic_cholesky(shape, Side::Lower, ordering, CholeskySymbolicParams::default())
            .map_err(|e| SparseError::Analysis(format!("{e:?}")))?;
        let length = symbolic.len_val();
        let (factor, request) = match precision {
            Precision::Double => (
                Factor::Double { values: vec![0.0; length], panels: panels(&symbolic, n) },
                requirement::<f64>(&symbolic),
            ),
            Precision::Single => (
                Factor::Single {
                    values: vec![0.0; length],
                    panels: panels(&symbolic, n),
                    entries: vec![0.0; pattern.row_idx.len()],
                    rhs: vec![0.0; n],
                },
                requirement::<f32>(&symbolic),
            ),
        };
        let memory = MemBuffer::try_new(request).map_err(|e| SparseError::Analysis(format!("{e:?}")))?;
        Ok(Self { pattern, symbolic, factor, memory, ready: false })
    }

    /// The pattern given to [`new`](Self::new); values of a matrix follow its `row_idx`.
    pub fn pattern(&self) -> &SymmetricPattern {
        &self.pattern
    }

    /// Stored entries of the factor.
    pub fn entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Whether a usable factor is held.
    pub fn is_factored(&self) -> bool {
        self.ready
    }

    /// Number of negative pivots of the held factor: 0 for a positive definite matrix, else its count of negative eigenvalues.
    pub fn negative_pivots(&self) -> usize {
        match &self.factor {
            _ if !self.ready => 0,
            Factor::Double { values, .. } => count_negative(&self.symbolic, values),
            Factor::Single { values, .. } => count_negative(&self.symbolic, values),
        }
    }

    /// Factorises the matrix with the given values of its lower triangle, in the order of the pattern.
    ///
    /// # Errors
    /// [`SparseError::ZeroPivot`] if a pivot vanishes or is not finite.
    ///
    /// # Panics
    /// If the number of values differs from the pattern's.
    pub fn factor(&mut self, values: &[f64]) -> Result<(), SparseError> {
        assert_eq!(values.len(), self.pattern.row_idx.len(), "one value per entry of the pattern");
        self.ready = false;
        let n = self.pattern.len();
        let shape = SymbolicSparseColMatRef::new_checked(n, n, &self.pattern.col_ptr, None, &self.pattern.row_idx);
        let stack = MemStack::new(&mut self.memory);
        let zero = |e: faer::linalg::cholesky::ldlt::factor::LdltError| {
            let faer::linalg::cholesky::ldlt::factor::LdltError::ZeroPivot { index } = e;
            SparseError::ZeroPivot { index }
        };
        match &mut self.factor {
            Factor::Double { values: l, panels } => {
                self.symbolic
                    .factorize_numeric_ldlt(
                        l,
                        SparseColMatRef::new(shape, values),
                        Side::Lower,
                        LdltRegularization::default(),
                        Par::Seq,
                        stack,
                        Default::default(),
                    )
                    .map_err(zero)?;
                lay_out(&self.symbolic, panels, l);
            }
            Factor::Single { values: l, panels, entries, .. } => {
                entries.iter_mut().zip(values).for_each(|(e, v)| *e = *v as f32);
                self.symbolic
                    .factorize_numeric_ldlt(
                        l,
                        SparseColMatRef::new(shape, entries.as_slice()),
                        Side::Lower,
                        LdltRegularization::default(),
                        Par::Seq,
                        stack,
                        Default::default(),
                    )
                    .map_err(zero)?;
                lay_out(&self.symbolic, panels, l);
            }
        }
        self.ready = true;
        Ok(())
    }

    /// Solves with the kept factor; `rhs` becomes the solution.
    ///
    /// # Panics
    /// If no factor is held or the length differs.
    pub fn solve_in_place(&mut self, rhs: &mut [f64]) {
        assert!(self.ready, "factor before solve");
        let n = self.pattern.len();
        assert_eq!(rhs.len(), n, "one value per row");
        match &mut self.factor {
            Factor::Double { values, panels } => substitute(&self.symbolic, values, panels, rhs, &mut self.memory),
            Factor::Single { values, panels, rhs: narrow, .. } => {
                // Scaled, so that tiny residuals do not fall below the smallest f32.
                let scale = rhs.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                if scale == 0.0 {
                    return;
                }
                narrow.iter_mut().zip(rhs.iter()).for_each(|(a, b)| *a = (*b / scale) as f32);
                substitute(&self.symbolic, values, panels, narrow, &mut self.memory);
                rhs.iter_mut().zip(narrow.iter()).for_each(|(a, b)| *a = f64::from(*b) * scale);
            }
        }
    }
}

/// The layout for solves, of a supernodal factor.
fn panels<T: Real>(symbolic: &SymbolicCholesky<usize>, n: usize) -> Option<Panels<T>> {
    match (symbolic.raw(), symbolic.perm()) {
        (SymbolicCholeskyRaw::Supernodal(s), Some(_)) => Some(Panels::new(s, n)),
        _ => None,
    }
}

fn lay_out<T: Real>(symbolic: &SymbolicCholesky<usize>, panels: &mut Option<Panels<T>>, values: &[T]) {
    if let (SymbolicCholeskyRaw::Supernodal(s), Some(panels)) = (symbolic.raw(), panels) {
        panels.fill(s, values);
    }
}

/// Solves with the factor in `values`, laid out in `panels` if it is supernodal.
fn substitute<T: Real + faer::traits::ComplexField>(
    symbolic: &SymbolicCholesky<usize>,
    values: &[T],
    panels: &mut Option<Panels<T>>,
    rhs: &mut [T],
    memory: &mut MemBuffer,
) {
    let n = rhs.len();
    match (panels, symbolic.perm()) {
        (Some(panels), Some(order)) => panels.solve(order.arrays().0, rhs),
        // Small or very sparse systems: the library's own.
        _ => LdltRef::new(symbolic, values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, n, 1),
            Par::Seq,
            MemStack::new(memory),
        ),
    }
}

fn requirement<T: faer::traits::ComplexField>(symbolic: &SymbolicCholesky<usize>) -> StackReq {
    StackReq::any_of(&[
        symbolic.factorize_numeric_ldlt_scratch::<T>(Par::Seq, Default::default()),
        symbolic.solve_in_place_scratch::<T>(1, Par::Seq),
    ])
}

fn count_negative<T: Copy + Into<f64>>(symbolic: &SymbolicCholesky<usize>, values: &[T]) -> usize {
    let negative = |k: usize| usize::from(values[k].into() < 0.0);
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(s) => s.col_ptr()[..s.ncols()].iter().map(|&k| negative(k)).sum(),
        SymbolicCholeskyRaw::Supernodal(s) => (0..s.n_supernodes())
            .map(|i| {
                let width = s.supernode_end()[i] - s.supernode_begin()[i];
                let height = width + s.nnz_per_super()[i];
                (0..width).map(|c| negative(s.col_ptr_for_val()[i] + c * (height + 1))).sum::<usize>()
            })
            .sum(),
    }
}

fn inverse(order: &[usize], n: usize) -> Result<Vec<usize>, SparseError> {
    let mut inverse = vec![usize::MAX; n];
    for (k, &row) in order.iter().enumerate() {
        match inverse.get_mut(row) {
            Some(slot) if *slot == usize::MAX => *slot = k,
            _ => return Err(SparseError::Analysis(format!("order is no permutation of 0..{n}"))),
        }
    }
    if order.len() == n {
        Ok(inverse)
    } else {
        Err(SparseError::Analysis(format!("order is no permutation of 0..{n}")))
    }
}
