//! The unit over the members of a team: the lead's values and saved states are those of a unit alone, bit for bit.

#[path = "common/terrain.rs"]
mod terrain;

use fmu_terrain::dem::spread::{Links, team_of_threads};
use terrain::Terrain;
use terramech_fmi2::{Team, UnitError};

const H: f64 = 5e-4;
/// A long bed, soil that sleeps, and a ball that is free to move beyond the middle.
const SPECIFICATION: &str = r#"{
    "soil": {"radius": {"uniform": {"least": 0.0055, "greatest": 0.0065}}, "rolling_friction": 0.1, "adhesion": {"pressure": 500.0}},
    "bed": {"length": 0.6, "width": 0.12, "fill": {"depth": 0.04}},
    "obstacles": [{"shape": {"sphere": {"radius": 0.025}}, "mass": 0.2, "position": [0.06, 0.0]}],
    "dem_p": {"sleep": {"distance": 0.15}}
}"#;

struct Member(Box<dyn Links>);

impl Team for Member {
    fn index(&self) -> usize {
        self.0.index()
    }
    fn size(&self) -> usize {
        self.0.size()
    }
    fn round(&mut self, out: &[(usize, Vec<u8>)], from: &[usize]) -> Result<Vec<Vec<u8>>, UnitError> {
        self.0.round(out.to_vec(), from).map_err(|e| UnitError::environment(e.to_string()))
    }
}

/// A wheel that drives over the bed, and into the ball.
fn wheel(t: &mut Terrain, height: f64, k: usize) {
    let time = k as f64 * H;
    t.xyz("body[1].position", [-0.12 + 1.5 * time, 0.0, height + 0.046 - 0.1 * time]);
    t.xyz("body[1].velocity", [1.5, 0.0, -0.1]);
    t.xyz("body[1].angular_velocity", [0.0, 40.0, 0.0]);
}

/// What is seen after each step, and a saved state in the middle.
fn drive(mut t: Terrain, saved: Option<&[u8]>) -> (Vec<u64>, Vec<u8>, Vec<u8>) {
    let mut from = 0;
    if let Some(saved) = saved {
        t.0.restore(saved).unwrap();
        from = 20;
    } else {
        t.string("body[1].shape", "cylinder");
        t.set("body[1].radius", 0.05);
        t.set("body[1].width", 0.04);
        t.begin().unwrap();
        let height = t.get("height");
        wheel(&mut t, height, 0);
        t.0.exit_initialization().unwrap();
    }
    let height = t.get("height");
    let (mut seen, mut middle) = (Vec::new(), Vec::new());
    for k in from..40 {
        if k == 20 {
            middle = t.0.save().unwrap();
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

/// The lead's part, with members that serve it.
fn spread(size: usize, saved: Option<Vec<u8>>) -> (Vec<u64>, Vec<u8>, Vec<u8>) {
    let mut members = team_of_threads(size).into_iter();
    let lead = members.next().unwrap();
    std::thread::scope(|scope| {
        for links in members {
            scope.spawn(move || {
                let mut t = fresh();
                t.0.set_team(Box::new(Member(links))).unwrap();
                t.0.setup(0.0, None).unwrap();
                t.0.serve_team().unwrap();
            });
        }
        let mut t = fresh();
        t.0.set_team(Box::new(Member(lead))).unwrap();
        drive(t, saved.as_deref())
    })
}

#[test]
fn the_lead_tells_what_a_unit_alone_tells() {
    let (seen, middle, end) = drive(fresh(), None);
    for size in [1, 2, 3] {
        let (other, halfway, last) = spread(size, None);
        let differs = seen.iter().zip(&other).position(|(a, b)| a != b);
        assert_eq!((differs, other.len()), (None, seen.len()), "{size}");
        assert!(middle == halfway && end == last, "saved states differ with {size} members");
        // What one left others go on with.
        let (rest, _, last) = spread(4 - size, Some(middle.clone()));
        assert!(rest == seen && last == end, "{size}");
    }
    let (rest, _, last) = drive(fresh(), Some(&middle));
    assert!(rest == seen && last == end);
}

#[test]
fn what_cannot_be_spread_says_so() {
    let team = || Box::new(Member(team_of_threads(1).remove(0)));
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
            t.0.set_team(Box::new(Member(other))).unwrap();
            t.0.setup(0.0, None).unwrap();
            assert!(t.0.serve_team().is_err());
        });
        let mut t = fresh();
        t.0.set_team(Box::new(Member(lead))).unwrap();
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
