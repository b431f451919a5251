//! Numerics that two or more units need: frames, rotations, triangle meshes.
