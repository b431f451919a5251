//! The one room for processor intrinsics: denormal mode and, later, contact kernels.
