//! Support code of the system tests.
