//! Tire units: the rigid wheel.
