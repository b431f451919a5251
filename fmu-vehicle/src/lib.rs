//! Vehicle units: the single-wheel rig.
