//! Paths to follow: points, a CSV file, a circle, a lane change; kept as a polyline.

use crate::vehicle::Place;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{RigidState, Vec3};

/// A path, in the frame of the vehicle at its start (X forward, Y left) unless `in_world`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PathSpec {
    /// Straight ahead.
    Straight {},
    /// A polyline.
    Points {
        /// Points (x, y) in m.
        points: Vec<[f64; 2]>,
        /// Points are in the inertial frame.
        #[serde(default)]
        in_world: bool,
    },
    /// A CSV file with columns x, y (m); a first line that is no number is a header.
    Csv {
        /// File name, relative to the specification.
        file: String,
        /// Points are in the inertial frame.
        #[serde(default)]
        in_world: bool,
    },
    /// A circle that begins after a straight lead, entered tangentially.
    Circle {
        /// Radius (m).
        radius: f64,
        /// Straight before it (m).
        lead: f64,
        /// To the right instead of to the left.
        #[serde(default)]
        right: bool,
    },
    /// A lane change: straight, a half cosine to the left, straight; with `back` a second one that returns.
    LaneChange {
        /// Straight before it (m).
        lead: f64,
        /// Length of the transition (m).
        length: f64,
        /// Lateral offset (m), negative to the right.
        offset: f64,
        /// Length of the straight in the other lane and of the way back (m): a double lane change as in ISO 3888-1.
        #[serde(default)]
        back: Option<[f64; 2]>,
    },
}

impl PathSpec {
    /// Reads a CSV file in place.
    pub fn resolve(&mut self, place: &Place, path: &str, f: &mut Faults) {
        let Self::Csv { file, in_world } = self else { return };
        match place.text(file) {
            Ok(text) => match parse(&text) {
                Ok(points) if points.len() < 2 => {
                    f.add(format!(
                        "'{path}.csv.file' {file} has {} point(s); allowed: at least two points",
                        points.len()
                    ));
                }
                Ok(points) => *self = Self::Points { points, in_world: *in_world },
                Err(e) => f.add(format!("'{path}.csv.file' {file}: {e}")),
            },
            Err(e) => f.add(format!("'{path}.csv.file': {e}")),
        }
    }
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        match self {
            Self::Straight {} => {}
            Self::Points { points, .. } => {
                let p = format!("{path}.points.points");
                f.check(points.len() >= 2, &p, format!("{} point(s)", points.len()), "at least two points");
                for (k, w) in points.windows(2).enumerate() {
                    let d = ((w[1][0] - w[0][0]).powi(2) + (w[1][1] - w[0][1]).powi(2)).sqrt();
                    f.check(
                        d > 1e-6,
                        &format!("{p}[{}]", k + 1),
                        format!("{:?}", w[1]),
                        "a finite point apart from the one before",
                    );
                }
            }
            Self::Csv { .. } => {}
            Self::Circle { radius, lead, .. } => {
                f.positive(&format!("{path}.circle.radius"), *radius);
                f.not_negative(&format!("{path}.circle.lead"), *lead);
            }
            Self::LaneChange { lead, length, offset, back } => {
                f.not_negative(&format!("{path}.lane_change.lead"), *lead);
                f.positive(&format!("{path}.lane_change.length"), *length);
                f.check(offset.is_finite(), &format!("{path}.lane_change.offset"), offset, "a finite number");
                for (k, x) in back.iter().flatten().enumerate() {
                    f.positive(&format!("{path}.lane_change.back[{k}]"), *x);
                }
            }
        }
    }
    /// The polyline, from the vehicle's place at the start.
    ///
    /// # Errors
    /// A file that was not read.
    pub fn build(&self, start: &RigidState) -> Result<Path, UnitError> {
        let (points, world) = match self {
            Self::Straight {} => (vec![[0.0, 0.0], [1e5, 0.0]], false),
            Self::Points { points, in_world } => (points.clone(), *in_world),
            Self::Csv { file, .. } => return Err(UnitError::input(format!("path '{file}' was not read"))),
            Self::Circle { radius, lead, right } => {
                let side = if *right { -1.0 } else { 1.0 };
                let mut p = vec![[-1.0, 0.0]];
                // 20 turns: a study that needs more gives points.
                p.extend((0..=20 * 720).map(|k| {
                    let a = f64::from(k) * std::f64::consts::TAU / 720.0;
                    [lead + radius * a.sin(), side * radius * (1.0 - a.cos())]
                }));
                (p, false)
            }
            Self::LaneChange { lead, length, offset, back } => {
                let mut p = vec![[-1.0, 0.0]];
                let mut change = |from: f64, length: f64, y0: f64, y1: f64| {
                    p.extend((0..=200).map(|k| {
                        let s = f64::from(k) / 200.0;
                        [from + s * length, y0 + (y1 - y0) * 0.5 * (1.0 - (std::f64::consts::PI * s).cos())]
                    }));
                };
                change(*lead, *length, 0.0, *offset);
                let mut end = (lead + length, *offset);
                if let Some([stay, way]) = back {
                    change(end.0 + stay, *way, *offset, 0.0);
                    end = (end.0 + stay + way, 0.0);
                }
                p.push([end.0 + 1e5, end.1]);
                (p, false)
            }
        };
        let x = start.orientation * Vec3::x();
        let n = x.xy().norm().max(1e-12);
        let (c, s) = (x.x / n, x.y / n);
        let place = |p: &[f64; 2]| {
            if world { *p } else { [start.position.x + c * p[0] - s * p[1], start.position.y + s * p[0] + c * p[1]] }
        };
        Ok(Path { points: points.iter().map(place).collect() })
    }
}

fn parse(text: &str) -> Result<Vec<[f64; 2]>, String> {
    let mut out = Vec::new();
    for (k, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()) {
        let cells: Vec<Result<f64, _>> = line.split(',').map(|c| c.trim().parse::<f64>()).collect();
        match cells.as_slice() {
            [Ok(x), Ok(y), ..] => out.push([*x, *y]),
            _ if k == 0 => {}
            _ => return Err(format!("line {}: '{line}'; two numbers x, y are expected", k + 1)),
        }
    }
    Ok(out)
}

/// A polyline in the inertial frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    points: Vec<[f64; 2]>,
}

impl Path {
    /// Signed distance (m) of the path from the point, positive if the path lies to the left of its own direction's right side, that is: if
    /// the point must move left. The search starts at segment `hint` and goes on from there, so that paths may cross themselves.
    pub fn lateral_error(&self, p: [f64; 2], hint: &mut usize) -> f64 {
        let n = self.points.len() - 1;
        let mut best = (f64::INFINITY, *hint, 0.0);
        for k in *hint..n {
            let (a, b) = (self.points[k], self.points[k + 1]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let l2 = dx * dx + dy * dy;
            let (px, py) = (p[0] - a[0], p[1] - a[1]);
            let s = ((px * dx + py * dy) / l2).clamp(0.0, 1.0);
            let (ex, ey) = (px - s * dx, py - s * dy);
            let d = (ex * ex + ey * ey).sqrt();
            if d < best.0 {
                // Positive when the point is right of the path's direction.
                let side = dy * px - dx * py;
                best = (d, k, if side >= 0.0 { d } else { -d });
            } else if d > best.0 + 5.0 {
                break;
            }
        }
        *hint = best.1;
        best.2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_the_sign_of_the_correction() {
        let path = PathSpec::Straight {}.build(&RigidState::default()).unwrap();
        assert_eq!(path.lateral_error([5.0, -2.0], &mut 0), 2.0);
        assert_eq!(path.lateral_error([5.0, 3.0], &mut 0), -3.0);
    }

    #[test]
    fn circles_and_lane_changes_go_where_they_should() {
        let c = PathSpec::Circle { radius: 12.0, lead: 20.0, right: false }.build(&RigidState::default()).unwrap();
        assert!(c.lateral_error([32.0, 12.0], &mut 0).abs() < 1e-3);
        let l = PathSpec::LaneChange { lead: 10.0, length: 20.0, offset: 3.5, back: Some([5.0, 20.0]) }
            .build(&RigidState::default())
            .unwrap();
        assert!(l.lateral_error([32.0, 3.5], &mut 0).abs() < 1e-9);
        assert!(l.lateral_error([80.0, 0.0], &mut 0).abs() < 1e-9);
    }

    #[test]
    fn a_path_of_one_point_is_refused() {
        let mut f = Faults::new();
        PathSpec::Points { points: vec![[0.0, 0.0]], in_world: false }.check("driver.path", &mut f);
        assert!(f.into_result("x").unwrap_err().to_string().contains("at least two points"));
        assert!(parse("x,y\n1,2\nfoo,3\n").unwrap_err().contains("line 3"));
    }
}
