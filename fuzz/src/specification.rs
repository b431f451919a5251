//! A specification: the first byte chooses the model, the rest is the JSON text. The unit reads it as it would in a run, up to initialisation mode; no
//! bed is settled and no tire inflated.

use std::cell::RefCell;

use terramech_fmi2::instance::Instance;
use terramech_fmi2::specification;

thread_local! {
    /// An instance of each model of each unit, made once: describing thousands of variables takes longer than reading a text.
    static UNITS: RefCell<Vec<Instance>> = RefCell::new(
        fmu_vehicle::models()
            .into_iter()
            .chain(fmu_tire::models())
            .chain(fmu_terrain::models())
            .map(|model| Instance::new(model, None, Box::new(|_, _| {})))
            .collect(),
    );
}

/// Reads it.
pub fn read(bytes: &[u8]) {
    let Some((&choice, text)) = bytes.split_first() else { return };
    let Ok(text) = std::str::from_utf8(text) else { return };
    if text.trim_start().starts_with('{') {
        UNITS.with_borrow_mut(|units| {
            let count = units.len();
            give(&mut units[usize::from(choice) % count], text);
        });
    }
}

fn give(unit: &mut Instance, text: &str) {
    if unit.model().name == "tire_ancf" {
        // Building it factorises matrices: only what comes before.
        if let Ok(tire) = specification::parse::<fmu_tire::ancf::spec::FlexibleTire>(text, "text") {
            drop((tire.laminates(), tire.profile()));
        }
        return;
    }
    unit.reset();
    let (reference, _) = unit.model().table.find("specification").expect("every model has one");
    unit.set_string(reference, text).expect("a text can be set");
    unit.setup(0.0, None).expect("the start");
    if let Err(refused) = unit.enter_initialization() {
        assert!(!refused.message.is_empty());
    }
}
