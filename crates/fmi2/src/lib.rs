//! The FMI 2.0 co-simulation interface, with our array and progress extensions, for both sides.
