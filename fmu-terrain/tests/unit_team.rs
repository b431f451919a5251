//! The unit over the members of a team: the lead's values and saved states are those of a unit alone, bit for bit.

#[path = "common/plough.rs"]
mod plough;
#[path = "common/terrain.rs"]
mod terrain;

use fmu_terrain::dem::spread::{Links, team_of_threads};
use plough::{long_bed, plough};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use terrain::Terrain;
use terramech_fmi2::{Pieces, Team, UnitError};

const H: f64 = 5e-4;
/// A long bed, soil that sleeps, and a ball that is free to move beyond the middle.
const SPECIFICATION: &str = r#"{
    "soil": {"radius": {"uniform": {"least": 0.0055, "greatest": 0.0065}}, "rolling_friction": 0.1, "adhesion": {"pressure": 500.0}},
    "bed": {"length": 0.6, "width": 0.12, "fill": {"depth": 0.04}, "laying": 0.8},
    "obstacles": [{"shape": {"sphere": {"radius": 0.025}}, "mass": 0.2, "position": [0.06, 0.0]}],
    "dem_p": {"sleep": {"distance": 0.15}}
}"#;

/// Counts its rounds, and bytes that come from the lead.
struct Member(Box<dyn Links>, Arc<[AtomicUsize; 2]>);

impl Team for Member {
    fn index(&self) -> usize {
        self.0.index()
    }
    fn size(&self) -> usize {
        self.0.size()
    }
    fn round(&mut self, out: &[(usize, Vec<u8>)], from: &[usize]) -> Result<Vec<Vec<u8>>, UnitError> {
        self.1[0].fetch_add(1, Ordering::Relaxed);
        let came = self.0.round(out.to_vec(), from).map_err(|e| UnitError::environment(e.to_string()))?;
        let from_lead = from.iter().zip(&came).filter(|(from, _)| **from == 0).map(|(_, bytes)| bytes.len());
        self.1[1].fetch_add(from_lead.sum(), Ordering::Relaxed);
        Ok(came)
    }
}

/// A wheel that drives over the bed, and into the ball.
fn wheel(t: &mut Terrain, height: f64, k: usize) {
    let time = k as f64 * H;
    t.xyz("body[1].position", [-0.12 + 1.5 * time, 0.0, height + 0.046 - 0.1 * time]);
    t.xyz("body[1].velocity", [1.5, 0.0, -0.1]);
    t.xyz("body[1].angular_velocity", [0.0, 40.0, 0.0]);
}

/// Makes the bed, and places the wheel on it.
fn begin(t: &mut Terrain) {
    t.string("body[1].shape", "cylinder");
    t.set("body[1].radius", 0.05);
    t.set("body[1].width", 0.04);
    t.begin().unwrap();
    let height = t.get("height");
    wheel(t, height, 0);
    t.0.exit_initialization().unwrap();
}

/// Where pieces of the saved state in the middle lie, and how many there should be.
type Kept<'a> = Option<(&'a Path, usize)>;

/// What is seen after each step, and a saved state in the middle.
fn drive(mut t: Terrain, saved: Option<&[u8]>, kept: Kept<'_>) -> (Vec<u64>, Vec<u8>, Vec<u8>) {
    let mut from = 0;
    if let Some(saved) = saved {
        t.0.set_pieces(kept.map(|(folder, _)| folder.join("any")));
        t.0.restore(saved).unwrap();
        t.0.set_pieces(None);
        from = 20;
    } else {
        begin(&mut t);
    }
    let height = t.get("height");
    let (mut seen, mut middle) = (Vec::new(), Vec::new());
    for k in from..40 {
        if k == 20 {
            let folder = kept.filter(|_| saved.is_none());
            t.0.set_pieces(folder.map(|(folder, _)| folder.join("7.terrain")));
            middle = t.0.save().unwrap();
            t.0.set_pieces(None);
            if let Some((folder, count)) = folder {
                assert_eq!(std::fs::read_dir(folder).unwrap().count(), count);
            }
        }
        wheel(&mut t, height, k);
        t.advance(k, H).unwrap();
        if k >= 20 {
            seen.extend(t.get_xyz("body[1].force"));
            seen.extend(t.get_xyz("body[1].moment"));
            seen.extend(t.array("obstacle.position"));
        }
        if k % 10 == 9 && k >= 20 {
            seen.extend(t.array("grain.position"));
            seen.extend(t.array("grain.force"));
            seen.push(t.get("kinetic_energy"));
            seen.push(t.get("dissipated_energy"));
            seen.push(t.get("body_work"));
        }
    }
    let end = t.0.save().unwrap();
    (seen.iter().map(|x| x.to_bits()).collect(), middle, end)
}

fn fresh() -> Terrain {
    Terrain::of(fmu_terrain::dem_p::model(), SPECIFICATION)
}

/// A lead, and members that serve it; each of them has gone through at least so many rounds in the end.
fn team<T>(size: usize, rounds: usize, lead: impl FnOnce(Terrain) -> T) -> T {
    let mut members = team_of_threads(size).into_iter();
    let first = members.next().unwrap();
    std::thread::scope(|scope| {
        for links in members {
            scope.spawn(move || {
                let mut t = fresh();
                let count = Arc::<[AtomicUsize; 2]>::default();
                t.0.set_team(Box::new(Member(links, Arc::clone(&count)))).unwrap();
                t.0.setup(0.0, None).unwrap();
                t.0.serve_team().unwrap();
                let count = count[0].load(Ordering::Relaxed);
                assert!(count >= rounds, "a member went through {count} rounds");
            });
        }
        let mut t = fresh();
        t.0.set_team(Box::new(Member(first, Arc::default()))).unwrap();
        lead(t)
    })
}

fn spread(size: usize, saved: Option<Vec<u8>>, kept: Kept<'_>) -> (Vec<u64>, Vec<u8>, Vec<u8>) {
    // Steps of half a millisecond take dozens of inner steps, each with a round.
    team(size, 200, |t| drive(t, saved.as_deref(), kept))
}

#[test]
fn the_lead_tells_what_a_unit_alone_tells() {
    let (seen, middle, end) = drive(fresh(), None, None);
    for size in [1, 2, 3] {
        let (other, halfway, last) = spread(size, None, None);
        let differs = seen.iter().zip(&other).position(|(a, b)| a != b);
        assert_eq!((differs, other.len()), (None, seen.len()), "{size}");
        assert!(middle == halfway && end == last, "saved states differ with {size} members");
        // What one left others go on with.
        let (rest, _, last) = spread(4 - size, Some(middle.clone()), None);
        assert!(rest == seen && last == end, "{size}");
    }
    let (rest, _, last) = drive(fresh(), Some(&middle), None);
    assert!(rest == seen && last == end);
}

#[test]
fn a_mesh_goes_to_those_members_alone_that_may_meet_it() {
    let (seen, middle) = plough(long_bed(), None, &|| ());
    assert!(seen.len() > 3000);
    for (size, saved) in [(2, None), (3, None), (3, Some(middle.as_slice())), (5, Some(middle.as_slice()))] {
        let mut members = team_of_threads(size).into_iter();
        let first = members.next().unwrap();
        let counts: Vec<Arc<[AtomicUsize; 2]>> = (0..size).map(|_| Arc::default()).collect();
        let (other, halfway) = std::thread::scope(|scope| {
            for (links, count) in members.zip(&counts[1..]) {
                scope.spawn(move || {
                    let mut t = long_bed();
                    t.0.set_team(Box::new(Member(links, Arc::clone(count)))).unwrap();
                    t.0.setup(0.0, None).unwrap();
                    t.0.serve_team().unwrap();
                });
            }
            let mut t = long_bed();
            t.0.set_team(Box::new(Member(first, Arc::clone(&counts[0])))).unwrap();
            // Settling together tells much more.
            plough(t, saved, &|| counts.iter().for_each(|c| c[1].store(0, Ordering::Relaxed)))
        });
        let differs = seen.iter().zip(&other).position(|(a, b)| a != b);
        assert_eq!((differs, other.len()), (None, seen.len()), "{size} members, saved: {}", saved.is_some());
        assert!(saved.is_some() || halfway == middle);
        // 258 vertices with three reals for place and velocity, 600 or 300 times.
        let whole = 258 * 6 * 8 * if saved.is_some() { 300 } else { 600 };
        let bytes = counts[1..].iter().map(|c| c[1].load(Ordering::Relaxed)).collect::<Vec<_>>();
        println!("bytes from the lead: {bytes:?}; all meshes: {whole}");
        // Of few members all may have soil that is awake.
        assert!(size < 5 || bytes[size - 2] < whole / 10, "{bytes:?}");
    }
}

/// A folder of its own, removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("terramech-team-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn members_leave_their_parts_of_a_state_in_files_and_any_number_goes_on_with_them() {
    let (seen, whole, end) = drive(fresh(), None, None);
    let folder = Folder::new("state");
    let (other, middle, last) = spread(3, None, Some((&folder.0, 3)));
    assert!(other == seen && last == end);
    assert!(50 * middle.len() < whole.len(), "{} bytes of {}", middle.len(), whole.len());
    for size in [2, 4] {
        let (rest, _, last) = spread(size, Some(middle.clone()), Some((&folder.0, 3)));
        assert!(rest == seen && last == end, "{size}");
    }
    let (rest, _, last) = drive(fresh(), Some(&middle), Some((&folder.0, 3)));
    assert!(rest == seen && last == end);
    // Faults: nowhere to look, a file of something else, none.
    let wrong = |prefix: Option<PathBuf>| {
        let mut t = fresh();
        t.0.set_pieces(prefix);
        t.0.restore(&middle).unwrap_err().message
    };
    assert!(wrong(None).contains("nobody has told where"));
    std::fs::copy(folder.0.join("7.terrain.0"), folder.0.join("7.terrain.2")).unwrap();
    let told = wrong(Some(folder.0.join("any")));
    assert!(told.contains("7.terrain.2") && told.contains("was not written with this state"), "{told}");
    std::fs::write(folder.0.join("7.terrain.1"), b"TMPIECE1").unwrap();
    assert!(wrong(Some(folder.0.join("any"))).contains("7.terrain.1: saved state: 8 bytes are too few"));
    std::fs::remove_file(folder.0.join("7.terrain.0")).unwrap();
    assert!(wrong(Some(folder.0.join("any"))).contains("7.terrain.0: cannot be read"));
}

#[test]
fn members_write_their_grains_and_the_lead_the_list() {
    let folder = Folder::new("frames");
    for size in [1, 3] {
        let grains = team(size, 0, |mut t| {
            begin(&mut t);
            t.advance(0, H).unwrap();
            let table = t.0.model().table.clone();
            let vr = |name: &str| table.find(name).unwrap().0;
            let fields =
                ["id", "radius", "velocity", "force"].map(|name| (vr(&format!("grain.{name}")), name.to_owned()));
            let position = vr("grain.position");
            let [prefix, out] = [folder.0.join(format!("bed{size}")), folder.0.join("no").join("bed")];
            t.0.write_pieces(&Pieces { prefix, position, fields: fields.to_vec() }).unwrap();
            // Positions are no field, a scalar is no array, and a file is no folder.
            let wrong = |t: &mut Terrain, prefix: &Path, position: u32, field: u32| {
                let pieces = Pieces { prefix: prefix.to_owned(), position, fields: vec![(field, "x".into())] };
                t.0.write_pieces(&pieces).unwrap_err().message
            };
            std::fs::write(folder.0.join("no"), "").unwrap();
            let (id, scalar, other) = (vr("grain.id"), vr("height"), vr("obstacle.position"));
            assert!(wrong(&mut t, &out, position, id).contains("cannot be written"));
            assert!(wrong(&mut t, &out, position, scalar).contains("is no array"));
            assert!(wrong(&mut t, &out, other, id).contains("only the arrays grain.*"));
            t.advance(1, H).unwrap();
            let count = vr("grain_count");
            t.0.integer(count).unwrap()
        });
        let list = std::fs::read_to_string(folder.0.join(format!("bed{size}.pvtp"))).unwrap();
        let mut points = 0;
        for k in 0..size {
            let name = format!("bed{size}_{k}.vtp");
            assert!(list.contains(&format!("<Piece Source=\"{name}\"/>")), "{list}");
            let bytes = std::fs::read(folder.0.join(&name)).unwrap();
            let head = String::from_utf8_lossy(&bytes[..600]).into_owned();
            let number = head.split("NumberOfPoints=\"").nth(1).and_then(|text| text.split('"').next()).unwrap();
            let number: i32 = number.parse().unwrap();
            assert!(number > grains / (2 * size as i32), "{number} of {grains}");
            points += number;
        }
        assert_eq!(points, grains);
        let told = ["Points", "id", "radius", "velocity", "force"].map(|name| format!("Name=\"{name}\""));
        assert!(told.iter().all(|text| list.contains(text)), "{list}");
    }
}

#[test]
fn what_cannot_be_spread_says_so() {
    let team = || Box::new(Member(team_of_threads(1).remove(0), Arc::default()));
    let mut rigid = Terrain::of(fmu_terrain::rigid::model(), "");
    assert!(rigid.0.set_team(team()).unwrap_err().message.contains("cannot be spread"));
    let mut other = Terrain::of(fmu_terrain::dem_c::model(), SPECIFICATION);
    assert!(other.0.set_team(team()).unwrap_err().message.contains("cannot be spread"));
    let mut alone = fresh();
    alone.0.setup(0.0, None).unwrap();
    assert!(alone.0.serve_team().unwrap_err().message.contains("serves nobody"));
}

#[test]
fn a_member_that_fails_is_told_by_the_lead() {
    let mut members = team_of_threads(2).into_iter();
    let (lead, other) = (members.next().unwrap(), members.next().unwrap());
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut t = fresh();
            t.0.set_team(Box::new(Member(other, Arc::default()))).unwrap();
            t.0.setup(0.0, None).unwrap();
            assert!(t.0.serve_team().is_err());
        });
        let mut t = fresh();
        t.0.set_team(Box::new(Member(lead, Arc::default()))).unwrap();
        t.string("body[1].shape", "cylinder");
        t.set("body[1].radius", 0.05);
        t.set("body[1].width", 0.04);
        t.begin().unwrap();
        let height = t.get("height");
        t.xyz("body[1].position", [0.2, 0.0, height + 0.1]);
        t.0.exit_initialization().unwrap();
        // Down through half the bed in one step, in the second member's part.
        t.xyz("body[1].velocity", [0.0, 0.0, -400.0]);
        let told = (0..4).find_map(|k| t.advance(k, H).err()).unwrap();
        assert!(told.contains("grain"), "{told}");
    });
}
