//! Errors of the rigid tire.

/// Why the arrays `contact.index` and `contact.force` do not fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// Lengths.
    #[error("'contact.index' has {indices} elements and 'contact.force' {reals}; allowed: three reals for each index")]
    Length {
        /// Elements of `contact.index`.
        indices: usize,
        /// Elements of `contact.force`.
        reals: usize,
    },
    /// A vertex that does not exist.
    #[error("'contact.index' element {element} is {index}; allowed: 0 to {last}", last = *vertices as i64 - 1)]
    Range {
        /// Element, counted from 0.
        element: usize,
        /// Its value.
        index: i32,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// Not ascending, or twice the same.
    #[error("'contact.index' element {element} is {index} after {previous}; allowed: ascending and unique")]
    Order {
        /// Element, counted from 0.
        element: usize,
        /// Its value.
        index: i32,
        /// The value before it.
        previous: i32,
    },
}
