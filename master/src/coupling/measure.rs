//! What a unit measures by itself (`terramech soil`), without any coupling.

use std::path::Path;
use std::sync::Arc;

use super::initialise::{Libraries, member};
use super::{Failure, Moment};
use crate::check::plan::Plan;
use crate::loading::Environment;

/// Has the one unit of a plan measure what its specification describes, into a folder.
///
/// # Errors
/// [`Failure::Load`], [`Failure::Unit`]; [`Failure::Input`] for a unit without such a function.
pub fn measure(plan: &Plan, threads: usize, environment: &Arc<dyn Environment>, folder: &Path) -> Result<(), Failure> {
    let threads = u32::try_from(threads.max(1)).unwrap_or(u32::MAX);
    let mut made = member(plan, 0, threads, true, &mut Libraries::default(), environment)?;
    if !made.instance.measures() {
        let fmu = plan.fmus.first().map(|fmu| fmu.path.display().to_string()).unwrap_or_default();
        return Err(Failure::Input(format!("{fmu}: this FMU has nothing to measure; allowed: terrain-dem-p.fmu")));
    }
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    made.instance.measure(&folder).map_err(|e| Failure::unit(e, Moment::Before, "soil tests"))
}
