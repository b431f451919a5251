//! Weak and strong scaling of a spread bed on paper: from what `cargo xtask bench mpi` has measured, over a cluster's network that is assumed and over what a ping-pong between two ranks of one
//! machine gave.

use anyhow::Result;
use std::fmt::Write as _;
use std::path::Path;
use terramech_results::report::{Axis, Plot, Style};

/// What was measured on this machine.
pub struct Measured {
    /// Grain-steps per second of one processor, list rebuilds included (1/s).
    pub rate: f64,
    /// Bytes per step and grain that is looked at behind a cut.
    pub bytes: f64,
}

/// What messages go over.
struct Network {
    name: &'static str,
    /// One way (s).
    latency: f64,
    /// One direction of a link (B/s).
    bandwidth: f64,
}

/// A ping-pong of Open MPI 4.1.4 between two ranks of a busy machine of this kind, through shared memory: there and back (s) with one double, with 3,000.
const PING_PONG: [f64; 2] = [0.5e-6, 36e-6];
/// A current cluster's, assumed; and the ping-pong's.
const NETWORKS: [Network; 2] = [
    Network { name: "cluster", latency: 1.5e-6, bandwidth: 10e9 },
    Network { name: "ping-pong", latency: 0.5 * PING_PONG[0], bandwidth: 2.0 * 24e3 / (PING_PONG[1] - PING_PONG[0]) },
];
/// Bytes that a core packs and unpacks per second.
const PACKING: f64 = 2e9;
/// Steps between two rebuilds, and between two that make everything anew.
const REBUILD: f64 = 33.0;
const WHOLE: f64 = 64.0 * REBUILD;
/// Vertices of four tires of 90 x 24 shells: positions and velocities (B), told once in a communication step of so many steps.
const MESHES: f64 = 4.0 * 2160.0 * 48.0;
const STEPS: f64 = 5.0;
/// What 500 contacts of a tire tell the lead in a step (B).
const LOADS: f64 = 500.0 * 210.0;
/// Radius (m), depth of the bed (m), share of solid, cell over radius.
const BED: [f64; 4] = [0.012, 0.3, 0.58, 2.15];

/// Grains in a layer of cells, and layers, of a bed two and a half times as long as wide.
fn layers(grains: f64) -> (f64, f64) {
    let [r, depth, solid, cell] = BED;
    let area = grains * 4.0 / 3.0 * std::f64::consts::PI * r.powi(3) / solid / depth;
    let layers = ((2.5 * area).sqrt() / (cell * r)).floor().max(1.0);
    (grains / layers, layers)
}

/// Wall time of a step (s) on so many members with one core each; none where a member would have less than one layer.
fn step(grains: f64, members: f64, m: &Measured, network: &Network) -> Option<f64> {
    let Network { latency, bandwidth, .. } = *network;
    let (layer, layers) = layers(grains);
    if members > layers {
        return None;
    }
    // Whole layers: the one with most keeps the others waiting.
    let work = (layers / members).ceil() * layer / m.rate;
    if members == 1.0 {
        return Some(work);
    }
    let rounds = members.log2().ceil();
    // Places one way, forces the other, each after the other; packed on one side, unpacked on the other.
    let cut = 2.0 * latency + layer * m.bytes * (1.0 / bandwidth + 2.0 / PACKING);
    // Whether lists must be made anew.
    let stale = rounds * latency;
    let bodies = latency + LOADS / bandwidth + rounds * (latency + MESHES / bandwidth) / STEPS;
    let slabs = grains / 1024.0;
    let lists = (rounds * latency + slabs * 17.0 / bandwidth) * 4.0 / REBUILD;
    let anew = members * (latency + 4.0 * layers / bandwidth) / WHOLE;
    Some(work + cut + stale + bodies + lists + anew)
}

/// Writes `mpi-scaling.md` and its plots into `folder`.
///
/// # Errors
/// A file that cannot be written.
pub fn write(folder: &Path, m: &Measured) -> Result<()> {
    let mut page = format!(
        "# A bed over many processes, on paper\n\nWritten by `cargo xtask bench mpi`, which measures the first two figures; `crates/xtask/src/bench/scaling.rs` holds the model.\n\n| | |\n|---|---|\n| grain-steps per second \
         of a processor, rebuilds included | {:.2e} |\n| bytes per step and grain at a cut | {:.0} |\n{}| packing (assumed) | {PACKING:.0e} B/s \
         |\n\nBeds of grains of 12 mm, 0.3 m deep, two and a half times as long as wide, one core a member. A step is the work of the member with most layers of cells; places and forces across a cut, one after the \
         other; the question whether lists must be made anew (log2 rounds); what tires and ground tell each other; slabs told to all at a rebuild, layers at one that makes all anew. No member has less than one layer: cuts are along \
         one axis. Not in the model: a wheel whose contacts one member computes while the others wait (measured on two members: see mpi.md), soil that sleeps, uneven cores, a network that others use. Two networks: a cluster's, assumed; and what a ping-pong between two ranks of one busy machine gave \
         (Open MPI 4.1.4: {:.1} us there and back with one double, {:.0} us with 3,000), as if all members sat so.\n\n",
        m.rate,
        m.bytes,
        NETWORKS
            .map(|n| format!("| {}: latency, bandwidth | {:.2e} s, {:.1e} B/s |\n", n.name, n.latency, n.bandwidth))
            .concat(),
        1e6 * PING_PONG[0],
        1e6 * PING_PONG[1],
    );
    let ranks = [1.0, 2.0, 10.0, 100.0, 1000.0, 10_000.0];
    writeln!(
        page,
        "## Strong scaling: steps per second, efficiency\n\n| grains | 1 | 2 | 10 | 100 | 1,000 | 10,000 |\n|---|---|---|---|---|---|---|"
    )?;
    let axes = || (Axis::new("decimal logarithm of the members", "1"), Axis::new("efficiency", "1"));
    let (x, y) = axes();
    let mut strong = Plot::new("Strong scaling, on paper", x, y);
    for (network, grains) in NETWORKS.iter().flat_map(|n| [1e6, 1e8, 1e9].map(|g| (n, g))) {
        let alone = step(grains, 1.0, m, network).unwrap_or(f64::NAN);
        let (mut xs, mut ys, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        for p in ranks {
            match step(grains, p, m, network) {
                Some(t) => {
                    cells.push(format!("{:.3}/s, {:.0} %", 1.0 / t, 100.0 * alone / t / p));
                    xs.push(p.log10());
                    ys.push(alone / t / p);
                }
                None => cells.push("more than layers".into()),
            }
        }
        writeln!(page, "| {grains:.0e}, {} | {} |", network.name, cells.join(" | "))?;
        strong = strong.with(format!("{grains:.0e} grains, {}", network.name), &xs, &ys, Style::Line);
    }
    writeln!(
        page,
        "\n![Strong scaling](mpi-strong.svg)\n\n## Weak scaling: 100,000 and 1,000,000 grains a member\n\n| grains a member | 1 | 2 | 10 | 100 | 1,000 | 10,000 |\n|---|---|---|---|---|---|---|"
    )?;
    let (x, y) = axes();
    let mut weak = Plot::new("Weak scaling, on paper", x, y);
    for (network, each) in NETWORKS.iter().flat_map(|n| [1e5, 1e6].map(|g| (n, g))) {
        let (mut xs, mut ys, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        for p in ranks {
            match step(each * p, p, m, network) {
                Some(t) => {
                    // Against perfect work, so that whole layers count as what they cost.
                    let efficiency = each / m.rate / t;
                    cells.push(format!("{:.3}/s, {:.0} %", 1.0 / t, 100.0 * efficiency));
                    xs.push(p.log10());
                    ys.push(efficiency);
                }
                None => cells.push("more than layers".into()),
            }
        }
        writeln!(page, "| {each:.0e}, {} | {} |", network.name, cells.join(" | "))?;
        weak = weak.with(format!("{each:.0e} a member, {}", network.name), &xs, &ys, Style::Line);
    }
    writeln!(
        page,
        "\n![Weak scaling](mpi-weak.svg)\n\nWhat bounds it: with cuts along one axis a member's two faces stay as large as the bed is wide, however many members there are. A second axis of cuts would help from a few hundred \
         members on; the question after each step, whether lists must be made anew, could ride with the places."
    )?;
    for (name, plot) in [("mpi-strong.svg", strong), ("mpi-weak.svg", weak)] {
        std::fs::write(folder.join(name), plot.svg())?;
    }
    std::fs::write(folder.join("mpi-scaling.md"), page)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_is_bounded_by_the_work() {
        let m = Measured { rate: 1e7, bytes: 120.0 };
        for network in &NETWORKS {
            let one = step(1e6, 1.0, &m, network).unwrap();
            assert!((one - 0.1).abs() < 1e-9);
            for p in [2.0, 10.0, 100.0] {
                let t = step(1e6, p, &m, network).unwrap();
                assert!(t > one / p && t < one, "{p}: {t}");
            }
            assert!(step(1e6, 1e4, &m, network).is_none());
        }
    }
}
