//! The usual sections of a run's report; a study picks from them and adds its own.

use super::plot::{Axis, Band, Level, Plot, Style};
use super::scale::{pretty_unit, range, short, shown, significant};
use super::{Item, Section, Table};
use crate::csv::{CsvTable, Data, Recorded};
use crate::manifest::{ExitState, Manifest};
use crate::summary::Headline;
use std::collections::BTreeMap;

/// Last parts of the names of the results that wheel studies look at first, with a heading.
const WHEEL_RESULTS: [(&str, &str); 4] =
    [("drawbar_pull", "Drawbar pull"), ("wheel_torque", "Wheel torque"), ("sinkage", "Sinkage"), ("slip", "Slip")];

/// The headline table, with measured values beside where there are any.
pub fn headlines(summary: &[Headline]) -> Section {
    let any = |f: fn(&Headline) -> bool| summary.iter().any(f);
    let (measured, window, source) =
        (any(|h| h.measured.is_some()), any(|h| h.window.is_some()), any(|h| h.source.is_some()));
    let pick = |cells: Vec<(bool, String)>| cells.into_iter().filter(|(show, _)| *show).map(|(_, text)| text).collect();
    let head = [
        (true, "Quantity"),
        (true, "Computed"),
        (measured, "Measured"),
        (measured, "Difference"),
        (true, "Unit"),
        (window, "Mean over"),
        (source, "Source of the measurement"),
    ];
    let rows = summary.iter().map(|h| {
        let size = h.measured.map_or(h.value.abs(), |m| m.abs().max(h.value.abs()));
        let show = shown(&h.unit, size);
        let text = |v: f64| significant(v * show.factor, 4);
        let difference = h.measured.filter(|m| *m != 0.0).map(|m| format!("{:+.1} %", 100.0 * (h.value - m) / m.abs()));
        pick(vec![
            (true, h.label.clone().unwrap_or_else(|| h.name.clone())),
            (true, text(h.value)),
            (measured, h.measured.map(text).unwrap_or_default()),
            (measured, difference.filter(|_| h.value.is_finite()).unwrap_or_default()),
            (true, show.unit.clone()),
            (window, h.window.map(window_text).unwrap_or_else(|| "the end".into())),
            (source, h.source.clone().unwrap_or_default()),
        ])
    });
    let table = Table {
        caption: String::new(),
        head: pick(head.map(|(show, text)| (show, text.to_owned())).to_vec()),
        rows: rows.collect(),
    };
    Section::new("Results", if summary.is_empty() { Vec::new() } else { vec![Item::Table(table)] })
}

/// Pull, torque, sinkage and slip over time wherever a component records them, raw and filtered in one plot, with averaging
/// windows and measured values from the summary.
pub fn over_time(csv: &CsvTable, summary: &[Headline]) -> Section {
    let mut plots = Vec::new();
    for (key, title) in WHEEL_RESULTS {
        let columns: Vec<&Recorded> = csv.columns.iter().filter(|c| last(stem(&c.name).0) == key).collect();
        let Some(unit) = columns.first().map(|c| c.unit.clone()) else { continue };
        let mut plot = Plot::new(title, Axis::new("time", "s"), Axis::new(title.to_lowercase(), &unit));
        add_curves(&mut plot, csv, &columns);
        for headline in summary.iter().filter(|h| last(stem(&h.name).0) == key && h.unit == unit) {
            if let Some([from, to]) = headline.window {
                let label = format!("averaged over {}", window_text([from, to]));
                let band = Band { from, to, label };
                plot.bands.extend((!plot.bands.contains(&band)).then_some(band));
            }
            plot.levels.extend(headline.measured.map(|y| Level { y, label: "measured".into() }));
        }
        if !plot.series.is_empty() {
            plots.push(Item::Plot(plot));
        }
    }
    Section::new("Over time", plots)
}

/// One closed section for each component with all its scalars: vectors in one plot, constants and texts as tables.
pub fn all_scalars(csv: &CsvTable) -> Vec<Section> {
    let mut components: Vec<(&str, Vec<&Recorded>)> = Vec::new();
    for column in &csv.columns {
        let name = column.name.split('.').next().unwrap_or_default();
        match components.iter_mut().find(|(n, _)| *n == name) {
            Some((_, columns)) => columns.push(column),
            None => components.push((name, vec![column])),
        }
    }
    components
        .into_iter()
        .map(|(name, columns)| {
            let title = format!("All of {name}: {} recorded scalars", columns.len());
            Section::new(title, component(csv, name, &columns)).collapsed()
        })
        .collect()
}

fn component(csv: &CsvTable, name: &str, columns: &[&Recorded]) -> Vec<Item> {
    let mut groups: BTreeMap<(String, &str), Vec<&Recorded>> = BTreeMap::new();
    let mut constants = Vec::new();
    let mut texts = Vec::new();
    for column in columns {
        let variable = column.name.strip_prefix(name).unwrap_or_default().trim_start_matches('.');
        match &column.data {
            Data::Text(values) => {
                let changes = csv.time.iter().zip(values).collect::<Vec<_>>();
                let changed = changes.chunk_by(|a, b| a.1 == b.1).map(|run| run[0]);
                texts.extend(changed.map(|(t, v)| vec![variable.to_owned(), short(*t), v.clone()]));
            }
            Data::Numbers(values) => match range(values) {
                Some([low, high]) if low < high => {
                    groups.entry((group(variable), &column.unit)).or_default().push(column)
                }
                Some([value, _]) => {
                    constants.push(vec![variable.to_owned(), short(value), pretty_unit(&column.unit)]);
                }
                None => constants.push(vec![variable.to_owned(), "never a number".into(), String::new()]),
            },
        }
    }
    let mut items: Vec<Item> = groups
        .into_iter()
        .map(|((title, unit), columns)| {
            let mut plot = Plot::new(&title, Axis::new("time", "s"), Axis::new(title.clone(), unit));
            add_curves(&mut plot, csv, &columns);
            Item::Plot(plot)
        })
        .collect();
    let table = |caption: &str, head: [&str; 3], rows| Table {
        caption: caption.into(),
        head: head.map(String::from).to_vec(),
        rows,
    };
    if !constants.is_empty() {
        items.push(Item::Table(table("Constant over the run", ["Variable", "Value", "Unit"], constants)));
    }
    if !texts.is_empty() {
        items.push(Item::Table(table("Texts", ["Variable", "From time [s]", "Text"], texts)));
    }
    items
}

/// Adds the columns as curves over time, each raw one just before its filtered partner.
fn add_curves(plot: &mut Plot, csv: &CsvTable, columns: &[&Recorded]) {
    let mut ordered: Vec<&Recorded> = columns.to_vec();
    ordered.sort_by_key(|c| (stem(&c.name).0.to_owned(), stem(&c.name).1 == Course::Filtered));
    let common = common_prefix(&ordered);
    for (i, column) in ordered.iter().enumerate() {
        let Data::Numbers(values) = &column.data else { continue };
        let (name, course) = stem(&column.name);
        let paired = |other: Option<&&Recorded>| other.is_some_and(|o| stem(&o.name).0 == name);
        let before = i.checked_sub(1).and_then(|i| ordered.get(i));
        let (style, word) = match course {
            Course::Filtered if paired(before) => (Style::Line, "filtered"),
            Course::Filtered => (Style::Line, ""),
            _ if paired(ordered.get(i + 1)) => (Style::Raw, "raw"),
            _ => (Style::Line, ""),
        };
        let rest = &name[common.min(name.len())..];
        let label = match (rest, word) {
            ("", word) => word.to_owned(),
            (rest, "") => rest.to_owned(),
            (rest, word) => format!("{rest} ({word})"),
        };
        *plot = std::mem::take(plot).with(label, &csv.time, values, style);
    }
}

/// Length of the start that the stems of all columns share, cut at a dot, or the whole when they are one quantity.
fn common_prefix(columns: &[&Recorded]) -> usize {
    let names: Vec<&str> = columns.iter().map(|c| stem(&c.name).0).collect();
    let Some(first) = names.first() else { return 0 };
    if names.iter().all(|n| n == first) {
        return first.len();
    }
    let same = |i: &usize| names.iter().all(|n| n.as_bytes().get(*i) == first.as_bytes().get(*i));
    let length = (0..first.len()).take_while(same).count();
    first.as_bytes()[..length].iter().rposition(|b| *b == b'.').map_or(0, |dot| dot + 1)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Course {
    Plain,
    Raw,
    Filtered,
}

/// The name without what tells its raw from its filtered course: `a.pull_filtered`, `a.pull.filtered` and `a.pull_raw`
/// are courses of `a.pull`.
fn stem(name: &str) -> (&str, Course) {
    for (ending, course) in [("filtered", Course::Filtered), ("mean", Course::Filtered), ("raw", Course::Raw)] {
        if let Some(stem) = name.strip_suffix(ending).and_then(|s| s.strip_suffix(['_', '.'])) {
            return (stem, course);
        }
    }
    (name, Course::Plain)
}

fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// Components of one vector, quaternion or tensor share a plot, and so do the courses of one quantity.
fn group(name: &str) -> String {
    let (name, _) = stem(name);
    match name.rsplit_once('.') {
        Some((vector, "x" | "y" | "z" | "w" | "xx" | "yy" | "zz" | "xy" | "yz" | "zx" | "xz")) => vector.to_owned(),
        _ => name.to_owned(),
    }
}

fn window_text([from, to]: [f64; 2]) -> String {
    format!("{} to {} s", short(from), short(to))
}

/// How the run ended, what it simulated and how fast: for below the page's headline.
pub fn chips(manifest: &Manifest) -> Vec<(String, String)> {
    let state = match &manifest.state {
        ExitState::Running => "running".to_owned(),
        ExitState::Done => "completed".to_owned(),
        ExitState::Stopped { reason } => format!("stopped: {reason}"),
        ExitState::Failed { message, .. } => format!("failed: {message}"),
    };
    // To the second: `2024-02-29 12:00:00 UTC`.
    let started = format!("{} UTC", manifest.started.split('.').next().unwrap_or_default().replace('T', " "));
    let mut chips = vec![("State", state), ("Started", started)];
    chips.push(("Simulated", format!("{} s", short(manifest.simulated_seconds))));
    chips.push(("Wall time", duration(manifest.wall_seconds)));
    chips.into_iter().map(|(k, v)| (k.to_owned(), v)).collect()
}

/// Machine, command, units with their timings, and inputs with their hashes.
pub fn run_facts(manifest: &Manifest) -> Vec<Section> {
    let machine = &manifest.machine;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let t = &manifest.timings;
    let since = if t.since > 0.0 { format!(", from {} s on", short(t.since)) } else { String::new() };
    let facts = [
        ("Command", manifest.command.join(" ")),
        ("Terramech", manifest.terramech.clone()),
        ("Machine", format!("{}, {} cores, {}, {}", machine.cpu, machine.cores, machine.arch, machine.os)),
        ("Instruction path", manifest.instruction_path.clone()),
        ("Threads", manifest.threads.to_string()),
        ("Real-time factor", significant(manifest.real_time_factor(), 3)),
        ("Initialisation", duration(t.initialise_seconds)),
        ("Coupled run", duration(t.run_seconds) + &since),
        ("Share of coupling", percent(t.coupling_share)),
        ("Share of recording", percent(t.io_share)),
    ];
    let facts = Table { rows: facts.into_iter().map(|(k, v)| vec![k.to_owned(), v]).collect(), ..Table::default() };
    let head = ["Unit", "Model", "Version", "GUID", "Threads", "Steps", "Time [s]", "Share"];
    let units = manifest.units.iter().map(|u| {
        let timing = t.units.iter().find(|t| t.name == u.name);
        let mut row = vec![u.name.clone(), u.model.clone(), u.version.clone(), u.guid.clone(), u.threads.to_string()];
        row.push(timing.map(|t| t.calls.to_string()).unwrap_or_default());
        row.push(timing.map(|t| significant(t.seconds, 4)).unwrap_or_default());
        row.push(timing.map(|t| percent(t.share)).unwrap_or_default());
        row
    });
    let units = Table { caption: String::new(), head: head.map(String::from).to_vec(), rows: units.collect() };
    let inputs = Table {
        caption: String::new(),
        head: ["Input", "Bytes", "SHA-256"].map(String::from).to_vec(),
        rows: manifest.inputs.iter().map(|i| vec![i.path.clone(), i.bytes.to_string(), i.sha256.clone()]).collect(),
    };
    let mut first = vec![Item::Table(facts)];
    first.extend((!units.rows.is_empty()).then_some(Item::Table(units)));
    let mut sections = vec![Section::new("Run facts", first)];
    if !inputs.rows.is_empty() {
        let title = format!("Inputs: {} files", inputs.rows.len());
        sections.push(Section::new(title, vec![Item::Table(inputs)]).collapsed());
    }
    sections
}

fn duration(seconds: f64) -> String {
    if seconds < 120.0 {
        return format!("{} s", significant(seconds, 3));
    }
    let whole = seconds.round() as u64;
    let (h, m, s) = (whole / 3600, whole / 60 % 60, whole % 60);
    if h > 0 { format!("{h} h {m:02} min") } else { format!("{m} min {s:02} s") }
}
