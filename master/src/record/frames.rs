//! `vtk/`: time series of points and meshes, written by a thread of their own.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use terramech_results::{Cells, Error, Field, PolyData, RunFolder, Values, VtkSeries};

use crate::check::plan::{ArrayPort, Plan, VtkDataset};
use crate::coupling::{Failure, Schedule, Show, System, WatchId};
use crate::loading::Slot;
use crate::model_description::{Kind, Variability};

/// One dataset at one instant.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Index of the dataset in the plan.
    pub dataset: usize,
    /// Name of the dataset.
    pub name: String,
    /// Time (s).
    pub time: f64,
    /// Positions (3n, m).
    pub points: Vec<f64>,
    /// Vertices of the triangles (3m); `None` for a cloud of points.
    pub triangles: Option<Vec<i32>>,
    /// Name, components a point, values.
    pub fields: Vec<(String, usize, Data)>,
}

/// Values of a field.
#[derive(Debug, Clone)]
pub enum Data {
    /// Reals.
    Real(Vec<f64>),
    /// Integers.
    Integer(Vec<i32>),
}

impl Frame {
    /// The values of a real field of that name with that many components.
    pub fn real(&self, name: &str, components: usize) -> Option<&[f64]> {
        self.fields.iter().find_map(|(field, n, data)| match data {
            Data::Real(values) if field == name && *n == components => Some(values.as_slice()),
            _ => None,
        })
    }
}

/// Where an array of a dataset is read.
type Source = (WatchId, Slot);

struct FieldSource {
    name: String,
    kind: Kind,
    values: Source,
    index: Option<Source>,
    /// Components a point, as last seen: an empty array does not tell.
    components: usize,
}

struct Dataset {
    name: String,
    schedule: Schedule,
    position: Source,
    triangle: Option<Source>,
    fields: Vec<FieldSource>,
    /// In how many pieces its unit writes the frames; 0: they are written here. Then values come only at the last base step at which one is due, for the picture.
    pieces: usize,
    last: u64,
}

/// What the writing thread is given.
enum Job {
    Write(Arc<Frame>),
    /// Take in the frame of this dataset and time (s), which its unit has written.
    Adopt(usize, f64),
    /// Answer when everything before this is on disk.
    Answer(SyncSender<()>),
}

/// The way to the writing thread, and the thread.
type Writer = (SyncSender<Job>, JoinHandle<Result<(), Error>>);

/// All datasets and the thread that writes them.
pub struct Frames {
    datasets: Vec<Dataset>,
    last: Vec<Option<Arc<Frame>>>,
    writer: Option<Writer>,
    remarks: Vec<String>,
    /// Times (s) of the frames of each dataset so far.
    times: Vec<Vec<f64>>,
}

impl Frames {
    /// `kept` are the times (s) of the frames that an earlier part of the run has written, for each dataset.
    pub fn new(system: &mut System, folder: &Arc<RunFolder>, kept: Option<&[Vec<f64>]>) -> Result<Self, Failure> {
        let plan = Arc::clone(system.plan());
        let datasets: Vec<Dataset> = plan.recording.vtk.iter().map(|d| dataset(system, &plan, d)).collect();
        let mut times = kept.map(<[_]>::to_vec).unwrap_or_default();
        times.resize(datasets.len(), Vec::new());
        let mut writer = None;
        if !datasets.is_empty() {
            // One frame under way and one waiting bound the memory; a run that outpaces the disk waits.
            let (sender, receiver) = sync_channel(1);
            let folder = Arc::clone(folder);
            let series = datasets
                .iter()
                .zip(&times)
                .map(|(d, times)| VtkSeries::new(&d.name).in_pieces(d.pieces).after(&folder, times))
                .collect();
            let thread = std::thread::Builder::new()
                .name("vtk".into())
                .spawn(move || write(&folder, series, receiver))
                .map_err(|e| Failure::Environment(format!("no thread for writing vtk files: {e}")))?;
            writer = Some((sender, thread));
        }
        Ok(Self { last: vec![None; datasets.len()], datasets, writer, remarks: Vec::new(), times })
    }

    pub fn observe(&mut self, system: &System, tick: u64) -> Result<(), Failure> {
        for index in 0..self.datasets.len() {
            let dataset = &mut self.datasets[index];
            if !dataset.schedule.is_due(tick) {
                continue;
            }
            if dataset.pieces > 0 {
                let time = system.clock().time(tick);
                self.times[index].push(time);
                let sent = self.writer.as_ref().is_none_or(|(sender, _)| sender.send(Job::Adopt(index, time)).is_ok());
                if !sent {
                    self.finish()?;
                }
                if tick == self.datasets[index].last {
                    self.last[index] = self.datasets[index].frame(index, system, tick).ok().map(Arc::new);
                }
                continue;
            }
            match dataset.frame(index, system, tick) {
                Ok(frame) => {
                    let frame = Arc::new(frame);
                    self.last[index] = Some(Arc::clone(&frame));
                    self.times[index].push(frame.time);
                    let sent = self.writer.as_ref().is_none_or(|(sender, _)| sender.send(Job::Write(frame)).is_ok());
                    if !sent {
                        // The thread has gone: it says why.
                        self.finish()?;
                    }
                }
                Err(remark) => {
                    let text = format!("vtk/{}.pvd: {remark}; this dataset is not written further", dataset.name);
                    dataset.schedule.to = 0;
                    dataset.schedule.from = 1;
                    self.remarks.push(text);
                }
            }
        }
        Ok(())
    }

    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    pub fn last(&self) -> Vec<Arc<Frame>> {
        self.last.iter().flatten().cloned().collect()
    }

    /// Waits until all frames so far are on disk; gives their times (s).
    pub fn save(&mut self) -> Result<&[Vec<f64>], Failure> {
        let (sender, receiver) = sync_channel(1);
        let answered = self
            .writer
            .as_ref()
            .is_none_or(|(writer, _)| writer.send(Job::Answer(sender)).is_ok() && receiver.recv().is_ok());
        if !answered {
            // The thread has gone: it says why.
            self.finish()?;
        }
        Ok(&self.times)
    }

    pub fn finish(&mut self) -> Result<(), Failure> {
        let Some((sender, thread)) = self.writer.take() else { return Ok(()) };
        drop(sender);
        match thread.join() {
            Ok(result) => Ok(result?),
            Err(_) => Err(Failure::Environment("the thread that writes vtk files has panicked".into())),
        }
    }
}

impl Drop for Frames {
    fn drop(&mut self) {
        // A run that ends by an error still leaves whole files.
        let _ = self.finish();
    }
}

fn dataset(system: &mut System, plan: &Plan, d: &VtkDataset) -> Dataset {
    let schedule = Schedule::every(d.every);
    let last = plan.clock.steps / d.every.max(1) * d.every.max(1);
    let pieces = in_pieces(system, d);
    if pieces > 0 {
        system.show(Show {
            unit: d.position.component,
            every: schedule.every,
            name: VtkSeries::new(&d.name).path(),
            position: d.position.value_reference,
            fields: d.fields.iter().map(|f| (f.array.value_reference, f.name.clone())).collect(),
        });
    }
    let mut source = |port: &ArrayPort, kind: Kind| -> Source {
        // What does not change after initialisation is read once.
        let fixed = plan.model(port.component).arrays[port.array].variability == Variability::Fixed;
        let when = match (fixed, pieces) {
            (true, _) => Schedule { every: 1, from: 0, to: 0 },
            (false, 0) => schedule,
            (false, _) => Schedule { every: 1, from: last, to: last },
        };
        let mut slot = Slot::RealArray(0);
        let id = system.watch(port.component, vec![when], |outputs| {
            slot = outputs.array(kind, port.value_reference, port.array);
        });
        (id, slot)
    };
    Dataset {
        name: d.name.clone(),
        schedule,
        pieces,
        last,
        position: source(&d.position, Kind::Real),
        triangle: d.triangle.as_ref().map(|t| source(t, Kind::Integer)),
        fields: d
            .fields
            .iter()
            .map(|f| FieldSource {
                name: f.name.clone(),
                kind: f.kind,
                values: source(&f.array, f.kind),
                index: f.index.as_ref().map(|i| source(i, Kind::Integer)),
                components: 1,
            })
            .collect(),
    }
}

/// In how many pieces a dataset is written: points of one unit that is spread, without triangles or values at some points only.
fn in_pieces(system: &System, d: &VtkDataset) -> usize {
    let unit = d.position.component;
    let plain = d.triangle.is_none() && d.fields.iter().all(|f| f.index.is_none() && f.array.component == unit);
    if plain { system.pieces_of(unit) } else { 0 }
}

impl Dataset {
    fn frame(&mut self, dataset: usize, system: &System, tick: u64) -> Result<Frame, String> {
        let reals = |(id, slot): Source| system.watched(id).reals_of(slot);
        let integers = |(id, slot): Source| system.watched(id).integers_of(slot);
        let points = reals(self.position).to_vec();
        if points.len() % 3 != 0 {
            return Err(format!("{} position values are no multiple of 3", points.len()));
        }
        let n = points.len() / 3;
        let triangles = self.triangle.map(|t| integers(t).to_vec());
        if let Some(t) = &triangles
            && (t.len() % 3 != 0 || t.iter().any(|&v| usize::try_from(v).map_or(true, |v| v >= n)))
        {
            return Err(format!("its {} triangle indices do not fit {n} points", t.len()));
        }
        let mut fields = Vec::with_capacity(self.fields.len());
        for f in &mut self.fields {
            let index = f.index.map(integers);
            let values = if f.kind == Kind::Real { reals(f.values).len() } else { integers(f.values).len() };
            let of = index.map_or(n, <[i32]>::len);
            match values.checked_rem(of) {
                None if values == 0 => {}
                Some(0) => f.components = values / of,
                _ => return Err(format!("field {} has {values} values for {of} points", f.name)),
            }
            if f.components == 0 {
                // No value at any point: the unit does not fill this array yet.
                continue;
            }
            let data = match f.kind {
                Kind::Real => Data::Real(spread(reals(f.values), index, f.components, n, &f.name)?),
                _ => Data::Integer(spread(integers(f.values), index, f.components, n, &f.name)?),
            };
            fields.push((f.name.clone(), f.components, data));
        }
        let (name, time) = (self.name.clone(), system.clock().time(tick));
        Ok(Frame { dataset, name, time, points, triangles, fields })
    }
}

/// Values at all of `n` points; with an index, at its points, and 0 elsewhere.
fn spread<T: Copy + Default>(
    values: &[T],
    index: Option<&[i32]>,
    components: usize,
    n: usize,
    name: &str,
) -> Result<Vec<T>, String> {
    let Some(index) = index else { return Ok(values.to_vec()) };
    let mut all = vec![T::default(); n * components];
    for (&i, value) in index.iter().zip(values.chunks_exact(components)) {
        let place = usize::try_from(i).ok().filter(|&i| i < n);
        let place = place.ok_or_else(|| format!("field {name} has a value at point {i} of {n}"))?;
        all[place * components..(place + 1) * components].copy_from_slice(value);
    }
    Ok(all)
}

/// The writing thread.
fn write(folder: &RunFolder, mut series: Vec<VtkSeries>, jobs: Receiver<Job>) -> Result<(), Error> {
    for job in jobs {
        let frame = match job {
            Job::Write(frame) => frame,
            Job::Adopt(dataset, time) => {
                series[dataset].adopt(folder, time)?;
                continue;
            }
            Job::Answer(to) => {
                // Whoever asked may have gone.
                let _ = to.send(());
                continue;
            }
        };
        let point_data = frame.fields.iter().map(|(name, components, data)| Field {
            name,
            components: *components,
            values: match data {
                Data::Real(values) => Values::Real(values),
                Data::Integer(values) => Values::Integer(values),
            },
        });
        let data = PolyData {
            points: &frame.points,
            cells: frame.triangles.as_ref().map_or(Cells::Vertices, |t| Cells::Triangles(t)),
            point_data: point_data.collect(),
            cell_data: Vec::new(),
        };
        series[frame.dataset].write(folder, frame.time, &data)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_at_some_points_are_spread_over_all() {
        let all = spread(&[1.0, 2.0, 3.0, 4.0], Some(&[0, 2]), 2, 3, "force").unwrap();
        assert_eq!(all, [1.0, 2.0, 0.0, 0.0, 3.0, 4.0]);
        let e = spread(&[1.0], Some(&[3]), 1, 3, "force").unwrap_err();
        assert!(e.contains("point 3 of 3"), "{e}");
    }
}
