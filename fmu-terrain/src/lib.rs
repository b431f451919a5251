//! Terrain units: granular soil by the discrete element method.
