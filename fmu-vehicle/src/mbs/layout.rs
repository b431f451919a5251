//! Which body and row belongs to which cluster: found once, when a model is built.

use super::{Body, Primitive};
use std::ops::Range;

/// Rows of one body in a cluster.
#[derive(Clone, Debug)]
pub struct ClusterBody {
    pub(crate) body: usize,
    /// Sorted by row.
    pub(crate) entries: Vec<Entry>,
}

/// One row's part on one body.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Row in the cluster.
    pub(crate) row: usize,
    /// 0 for A's six coefficients, 6 for B's.
    pub(crate) side: usize,
    /// For hubs: column in the cluster's list of hub columns.
    pub(crate) col: usize,
}

/// Interior bodies that hang together through joints, with all rows on them.
#[derive(Clone, Debug)]
pub struct Cluster {
    pub(crate) row0: usize,
    pub(crate) n: usize,
    pub(crate) bodies: Vec<ClusterBody>,
    pub(crate) hub_entries: Vec<Entry>,
    /// Spin couplings: row and local column.
    pub(crate) spins: Vec<(usize, usize)>,
    /// Hub columns touched, ascending.
    pub(crate) cols: Vec<usize>,
}

/// The arrow's structure. Rows are numbered cluster by cluster, rows between hubs last.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    pub(crate) clusters: Vec<Cluster>,
    /// First column of a hub body, per body.
    pub(crate) hub_col: Vec<Option<usize>>,
    /// First column of the shafts.
    pub(crate) shaft_col: usize,
    /// Number of hub columns, shafts included.
    pub(crate) nb: usize,
    pub(crate) hub_rows: Range<usize>,
    /// Spin couplings of hubs: row and column.
    pub(crate) hub_spins: Vec<(usize, usize)>,
    /// Bodies A and B of each row.
    pub(crate) sides: Vec<(usize, usize)>,
    /// First row of each primitive.
    pub(crate) first_row: Vec<usize>,
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

impl Layout {
    /// Finds clusters for constraints (primitive, A, B); `hub` says per body whether it is a hub; body 0, the ground, is neither.
    pub(crate) fn new(bodies: &[Body], hub: &[bool], constraints: &[(Primitive, usize, usize)], ny: usize) -> Self {
        let nbodies = bodies.len();
        let interior = |b: usize| b != 0 && !hub[b];
        let mut parent: Vec<usize> = (0..nbodies).collect();
        for (_, a, b) in constraints {
            if interior(*a) && interior(*b) {
                let (ra, rb) = (root(&mut parent, *a), root(&mut parent, *b));
                parent[ra.max(rb)] = ra.min(rb);
            }
        }
        let mut hub_col = vec![None; nbodies];
        let mut nb = 0;
        for b in 1..nbodies {
            if hub[b] {
                hub_col[b] = Some(nb);
                nb += 6;
            }
        }
        let shaft_col = nb;
        nb += ny;
        // Constraints of each cluster, by the root body's number; None: between hubs.
        let mut of_cluster: std::collections::BTreeMap<usize, Vec<usize>> = Default::default();
        let mut of_hubs = Vec::new();
        for (k, (_, a, b)) in constraints.iter().enumerate() {
            match [*a, *b].into_iter().find(|&b| interior(b)) {
                Some(body) => of_cluster.entry(root(&mut parent, body)).or_default().push(k),
                None => of_hubs.push(k),
            }
        }
        let mut l = Self { hub_col, shaft_col, nb, first_row: vec![0; constraints.len()], ..Default::default() };
        for list in of_cluster.values() {
            let order = order(list, constraints, &interior);
            let row0 = l.sides.len();
            for &k in &order {
                let (p, a, b) = &constraints[k];
                l.first_row[k] = l.sides.len();
                for _ in 0..p.rows() {
                    l.sides.push((*a, *b));
                }
            }
            let n = l.sides.len() - row0;
            let mut c = Cluster { row0, n, bodies: vec![], hub_entries: vec![], spins: vec![], cols: vec![] };
            for &k in &order {
                let (p, a, b) = &constraints[k];
                for body in [*a, *b] {
                    if let Some(first) = l.hub_col[body] {
                        c.cols.extend(first..first + 6);
                    }
                }
                if let Primitive::Spin { shaft, .. } = p {
                    c.cols.push(l.shaft_col + shaft);
                }
            }
            c.cols.sort_unstable();
            c.cols.dedup();
            let local = |col: usize, cols: &[usize]| cols.binary_search(&col).expect("column was collected");
            for &k in &order {
                let (p, a, b) = &constraints[k];
                for i in 0..p.rows() {
                    let row = l.first_row[k] - row0 + i;
                    for (body, side) in [(*a, 0), (*b, 6)] {
                        if interior(body) {
                            let entry = Entry { row, side, col: 0 };
                            match c.bodies.iter_mut().find(|x| x.body == body) {
                                Some(x) => x.entries.push(entry),
                                None => c.bodies.push(ClusterBody { body, entries: vec![entry] }),
                            }
                        } else if let Some(first) = l.hub_col[body] {
                            c.hub_entries.push(Entry { row, side, col: local(first, &c.cols) });
                        }
                    }
                    if let Primitive::Spin { shaft, .. } = p {
                        c.spins.push((row, local(l.shaft_col + shaft, &c.cols)));
                    }
                }
            }
            l.clusters.push(c);
        }
        let first = l.sides.len();
        for &k in &of_hubs {
            let (p, a, b) = &constraints[k];
            l.first_row[k] = l.sides.len();
            if let Primitive::Spin { shaft, .. } = p {
                l.hub_spins.push((l.sides.len(), l.shaft_col + shaft));
            }
            for _ in 0..p.rows() {
                l.sides.push((*a, *b));
            }
        }
        l.hub_rows = first..l.sides.len();
        l
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.sides.len()
    }
}

/// Greedy minimum degree over the constraints of a cluster: those with fewest neighbours first, so that factors stay sparse.
fn order(list: &[usize], constraints: &[(Primitive, usize, usize)], interior: &dyn Fn(usize) -> bool) -> Vec<usize> {
    let n = list.len();
    let mut near = vec![vec![false; n]; n];
    for i in 0..n {
        for j in 0..n {
            let ((_, a, b), (_, c, d)) = (&constraints[list[i]], &constraints[list[j]]);
            near[i][j] = [a, b].into_iter().any(|x| interior(*x) && (x == c || x == d));
        }
    }
    let rows = |i: usize| constraints[list[i]].0.rows();
    let mut left: Vec<usize> = (0..n).collect();
    let mut out = Vec::with_capacity(n);
    while !left.is_empty() {
        let degree = |&i: &usize| left.iter().filter(|&&j| near[i][j]).map(|&j| rows(j)).sum::<usize>();
        let best = *left.iter().min_by_key(|i| (degree(i), **i)).expect("not empty");
        left.retain(|&i| i != best);
        for &i in &left {
            for &j in &left {
                if near[i][best] && near[best][j] {
                    near[i][j] = true;
                }
            }
        }
        out.push(list[best]);
    }
    out
}
