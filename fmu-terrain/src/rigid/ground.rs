//! The ground as a height field: shape, obstacles, friction.

use super::config::{GroundObstacle, Rigid, Shape};
use super::facets::Facets;
use super::grid::Grid;
use serde::{Deserialize, Serialize};
use std::path::Path;
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Vec3, obj};

/// The ground over a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundPoint {
    /// Height (m).
    pub height: f64,
    /// Upward unit normal.
    pub normal: Vec3,
    /// Coulomb friction (1).
    pub friction: f64,
}

/// The ground with the contents of its files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ground {
    height: f64,
    friction: f64,
    base: Base,
    friction_map: Option<Grid>,
    obstacles: Vec<GroundObstacle>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Base {
    Plane([f64; 2]),
    Mesh(Facets),
    Map(Grid),
}

/// Least vertical part of a normal: the ground is a height field, and what is steeper than this (80 degrees) counts as just as steep.
const STEEP: f64 = 0.17;

impl Ground {
    /// Reads the files of a checked specification. Names are relative to `folder`; faults name the JSON path.
    pub fn read(spec: &Rigid, folder: &Path, f: &mut Faults) -> Option<Self> {
        let base = match &spec.shape {
            Shape::Plane { slope } => Some(Base::Plane(*slope)),
            Shape::HeightMap(m) => {
                Grid::read(m, folder).map(Base::Map).map_err(|e| f.add(format!("'rigid.shape.height_map': {e}"))).ok()
            }
            Shape::Mesh { file, smooth } => mesh(&folder.join(file), *smooth)
                .map(Base::Mesh)
                .map_err(|e| f.add(format!("'rigid.shape.mesh': {e}")))
                .ok(),
        };
        let friction_map = match &spec.friction_map {
            None => Some(None),
            Some(m) => friction(m, folder).map(Some).map_err(|e| f.add(format!("'rigid.friction_map': {e}"))).ok(),
        };
        Some(Self {
            height: spec.height,
            friction: spec.friction,
            base: base?,
            friction_map: friction_map?,
            obstacles: spec.obstacles.clone(),
        })
    }

    /// The ground over (x, y) in m.
    pub fn at(&self, x: f64, y: f64) -> GroundPoint {
        let by_slope = |z: f64, s: [f64; 2]| (z, Vec3::new(-s[0], -s[1], 1.0).normalize());
        let (mut height, mut normal) = match &self.base {
            Base::Plane(slope) => by_slope(self.height + slope[0] * x + slope[1] * y, *slope),
            Base::Mesh(facets) => facets.at(x, y).unwrap_or((self.height, Vec3::z())),
            Base::Map(grid) => {
                let (z, slope) = grid.at(x, y);
                by_slope(self.height + z, slope)
            }
        };
        let below = height;
        for o in &self.obstacles {
            if let Some((rise, slope)) = o.at(x, y)
                && below + rise > height
            {
                (height, normal) = by_slope(below + rise, slope);
            }
        }
        if normal.z < STEEP {
            let level = normal.xy().norm();
            let s = (1.0 - STEEP * STEEP).sqrt() / level;
            normal = Vec3::new(normal.x * s, normal.y * s, STEEP);
        }
        let friction = match &self.friction_map {
            Some(map) if map.covers(x, y) => map.at(x, y).0,
            _ => self.friction,
        };
        GroundPoint { height, normal, friction }
    }

    /// What the ground is, for the log.
    pub fn describe(&self) -> String {
        let shape = match &self.base {
            Base::Plane(s) => format!("plane with slopes {}, {}", s[0], s[1]),
            Base::Mesh(m) => format!("mesh from {} to {} m", m.range()[0], m.range()[1]),
            Base::Map(g) => format!("height map from {} to {} m", g.range()[0], g.range()[1]),
        };
        format!("rigid ground: {shape}, {} obstacle(s), friction {}", self.obstacles.len(), self.friction)
    }
}

fn mesh(path: &Path, smooth: bool) -> Result<Facets, String> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).map_err(|e| format!("file {shown}: cannot be read: {e}"))?;
    let mesh = obj::read(&text).map_err(|e| format!("file {shown}: {e}"))?;
    Facets::new(mesh, smooth).map_err(|e| format!("file {shown}: {e}"))
}

fn friction(map: &super::config::Map, folder: &Path) -> Result<Grid, String> {
    let grid = Grid::read(map, folder)?;
    let [least, most] = grid.range();
    if least < 0.0 || most > 10.0 {
        return Err(format!("file {}: friction from {least} to {most}; allowed: 0 to 10", map.file));
    }
    Ok(grid)
}

impl GroundObstacle {
    /// Rise (m) over the ground and its slopes by x and y, where the obstacle is.
    fn at(&self, x: f64, y: f64) -> Option<(f64, [f64; 2])> {
        let local = |position: &[f64; 2], angle: f64| {
            let (s, c) = angle.sin_cos();
            let (dx, dy) = (x - position[0], y - position[1]);
            (c * dx + s * dy, c * dy - s * dx, [c, s])
        };
        match self {
            Self::HalfRound { position, radius, length, angle } => {
                let (along, across, [c, s]) = local(position, *angle);
                let z2 = radius * radius - along * along;
                if z2 <= 0.0 || across.abs() > 0.5 * length {
                    return None;
                }
                let z = z2.sqrt();
                let slope = -along / z;
                Some((z, [slope * c, slope * s]))
            }
            Self::Bump { position, height, length, width, angle } => {
                let (along, across, [c, s]) = local(position, *angle);
                if along.abs() >= 0.5 * length || across.abs() > 0.5 * width {
                    return None;
                }
                let phase = std::f64::consts::TAU * along / length;
                let slope = -0.5 * height * phase.sin() * std::f64::consts::TAU / length;
                Some((0.5 * height * (1.0 + phase.cos()), [slope * c, slope * s]))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(spec: &Rigid) -> Ground {
        let mut f = Faults::new();
        spec.check(&mut f);
        let g = Ground::read(spec, Path::new("."), &mut f);
        f.into_result("test").unwrap();
        g.unwrap()
    }

    #[test]
    fn a_sloped_plane() {
        let g = ground(&Rigid { height: 0.5, shape: Shape::Plane { slope: [0.1, -0.2] }, ..Rigid::default() });
        let p = g.at(2.0, 1.0);
        assert!((p.height - 0.5).abs() < 1e-15 && (p.normal - Vec3::new(-0.1, 0.2, 1.0).normalize()).norm() < 1e-15);
        assert_eq!(p.friction, 0.9);
    }

    #[test]
    fn obstacles_stand_on_the_ground() {
        let half = GroundObstacle::HalfRound { position: [2.0, 0.0], radius: 0.1, length: 1.0, angle: 0.0 };
        let bump = GroundObstacle::Bump { position: [0.0, 5.0], height: 0.2, length: 2.0, width: 1.0, angle: 1.2 };
        let g = ground(&Rigid { height: 1.0, obstacles: vec![half, bump], ..Rigid::default() });
        assert_eq!(g.at(2.0, 0.2).height, 1.1);
        let p = g.at(2.06, 0.0);
        assert!((p.height - 1.08).abs() < 1e-12 && (p.normal - Vec3::new(0.6, 0.0, 0.8)).norm() < 1e-12);
        assert_eq!(g.at(2.0, 0.6).height, 1.0, "beyond its end");
        assert!(g.at(2.0999999, 0.0).normal.z > 0.16);
        assert_eq!(g.at(0.0, 5.0).height, 1.2);
        // Slopes are the derivatives of the height.
        let (x, y, e) = (0.2, 5.3, 1e-6);
        let n = g.at(x, y).normal;
        assert!(((g.at(x + e, y).height - g.at(x - e, y).height) / (2.0 * e) + n.x / n.z).abs() < 1e-7);
        assert!(((g.at(x, y + e).height - g.at(x, y - e).height) / (2.0 * e) + n.y / n.z).abs() < 1e-7);
    }
}
