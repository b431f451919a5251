//! A deforming mesh over soil that sleeps: a saved state goes on to the same bits, though the mesh is made anew from it.

#[path = "common/plough.rs"]
mod plough;
#[path = "common/terrain.rs"]
mod terrain;

use plough::{long_bed, plough};

#[test]
fn a_saved_state_goes_on_to_the_same_bits_under_a_deforming_mesh() {
    let (seen, middle) = plough(long_bed(), None, &|| ());
    assert!(seen.len() > 10_000);
    let (again, _) = plough(long_bed(), Some(&middle), &|| ());
    let differs = seen.iter().zip(&again).position(|(a, b)| a != b);
    assert_eq!((differs, again.len()), (None, seen.len()));
}
