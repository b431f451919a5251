//! A checkpoint: where the first byte is even, the whole system's, as it is and with a checksum that fits; where it is odd, the state of one unit, which
//! must then step or refuse.

use std::cell::RefCell;

use sha2::{Digest, Sha256};
use terramech::checkpoint::Checkpoint;
use terramech_fmi2::instance::{Instance, Mode};
use terramech_fmi2::state;

/// Reads it.
pub fn read(bytes: &[u8]) {
    let Some((kind, bytes)) = bytes.split_first() else { return };
    if kind % 2 == 0 {
        system(bytes);
    } else {
        UNITS.with_borrow_mut(|units| {
            let count = units.len();
            unit(&mut units[usize::from(kind / 2) % count], bytes);
        });
    }
}

/// After the magic number: length of the header, header, states.
fn system(bytes: &[u8]) {
    let _ = Checkpoint::decode(bytes);
    let mut sealed = b"TMCHECK2".to_vec();
    sealed.extend_from_slice(bytes);
    let hash = Sha256::digest(&sealed);
    sealed.extend_from_slice(&hash);
    if let Ok(read) = Checkpoint::decode(&sealed) {
        let again = Checkpoint::decode(&read.encode().expect("it can be written")).expect("it can be read again");
        assert_eq!((again.units, again.header.tick), (read.units, read.header.tick));
    }
}

thread_local! {
    /// Small units of the tests, but not the one that hangs as it is made to.
    static UNITS: RefCell<Vec<Instance>> = RefCell::new(
        testunits::models()
            .into_iter()
            .filter(|m| !["trouble", "block"].contains(&m.name))
            .map(|model| Instance::new(model, None, Box::new(|_, _| {})))
            .collect(),
    );
}

/// After the model's GUID: the stage, the time, the values, the unit's own.
fn unit(unit: &mut Instance, bytes: &[u8]) {
    let guid = unit.model().guid();
    let mut body = vec![guid.len() as u8];
    body.extend_from_slice(guid.as_bytes());
    body.extend_from_slice(bytes);
    unit.reset();
    if unit.restore(&state::seal(b"TMSTATE1", &body)).is_err() || unit.mode() != Mode::StepComplete {
        return;
    }
    let _ = unit.do_step(unit.last_successful_time(), 1e-3);
    for vr in 0..unit.model().table.variables().len() as u32 {
        let _ = (unit.real(vr).is_ok(), unit.integer(vr).is_ok(), unit.string(vr).is_ok(), unit.array_size(vr).is_ok());
    }
}
