//! Specification of the rigid tire, and what is made of it: mesh, masses, material.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::{Faults, Specification};
use terramech_mechanics::TriangleMesh;
use terramech_mechanics::cylinder::{Cylinder, Grousers};
use terramech_mechanics::obj;

/// Rigid tire: a wheel that does not deform. SI units.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RigidTire {
    /// Form of the wheel. Axle along Y, wheel centre at the origin.
    pub shape: Shape,
    /// Mass and inertia of the whole wheel. All of it is handed to the hub, so no mass counts twice.
    pub mass: Mass,
    /// Surface material, for the terrain's contact.
    pub material: Material,
    /// Which of the terrain's answers acts on the wheel.
    pub contact: ContactPath,
}

/// Form of the wheel: one of the two.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A cylinder, smooth or with straight grousers.
    Cylinder(CylinderShape),
    /// A Wavefront OBJ mesh.
    Obj(ObjShape),
}

impl Default for Shape {
    fn default() -> Self {
        Self::Cylinder(CylinderShape::default())
    }
}

/// A cylinder about the Y axis. Default: the smooth wheel of the single-wheel experiment.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CylinderShape {
    /// Undeformed radius, without grousers (m).
    pub radius: f64,
    /// Width along the axle (m).
    pub width: f64,
    /// Facets around the circumference, 8 to 10000. Facets lie inside the radius by at most radius (1 - cos(pi / divisions)).
    pub divisions: u32,
    /// Straight bars across the tread; null for a smooth wheel.
    pub grousers: Option<GrouserShape>,
}

impl Default for CylinderShape {
    fn default() -> Self {
        Self { radius: 0.058, width: 0.05, divisions: 60, grousers: None }
    }
}

/// Straight radial bars, evenly spaced.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrouserShape {
    /// How many.
    pub count: u32,
    /// Height above the cylinder (m).
    pub height: f64,
    /// Thickness along the circumference (m).
    pub thickness: f64,
}

/// A mesh from a file: closed, wound outward, axle along Y, wheel centre at the origin.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjShape {
    /// Path of the OBJ file, relative to this specification.
    pub file: String,
    /// Factor from the file's lengths to metres (1).
    #[serde(default = "one")]
    pub scale: f64,
    /// Undeformed radius (m), to which slip and sinkage refer; null: the greatest distance of a vertex from the axle.
    #[serde(default)]
    pub radius: Option<f64>,
}

fn one() -> f64 {
    1.0
}

/// Mass of the wheel: give exactly one of `mass` and `density`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mass {
    /// Mass (kg).
    #[serde(default)]
    pub mass: Option<f64>,
    /// Density of a uniform solid that fills the mesh (kg/m3).
    #[serde(default)]
    pub density: Option<f64>,
    /// Inertia about the wheel centre (kg m2); null: that of the uniform solid with this mass.
    #[serde(default)]
    pub inertia: Option<Inertia>,
}

impl Default for Mass {
    fn default() -> Self {
        Self { mass: Some(0.5), density: None, inertia: None }
    }
}

/// Principal moments about the wheel centre, axes of the wheel (y is the axle).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Inertia {
    /// About X (kg m2).
    pub xx: f64,
    /// About the axle (kg m2).
    pub yy: f64,
    /// About Z (kg m2).
    pub zz: f64,
}

/// Surface of the wheel.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// Coefficient of friction (1).
    pub friction: f64,
    /// Coefficient of restitution, 0 to 1 (1).
    pub restitution: f64,
    /// Young's modulus (Pa).
    pub young_modulus: f64,
    /// Poisson's ratio, above -1, at most 0.5 (1).
    pub poisson_ratio: f64,
}

impl Default for Material {
    fn default() -> Self {
        Self { friction: 0.5, restitution: 0.1, young_modulus: 1e7, poisson_ratio: 0.3 }
    }
}

/// Which of the terrain's answers acts on the wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactPath {
    /// The total wrench about the wheel centre: inputs `contact.force.x` to `contact.moment.z`.
    #[default]
    Wrench,
    /// Forces at vertices: input arrays `contact.index` and `contact.force`, summed here.
    Vertices,
}

/// A wheel ready to run: everything that the specification and its files say, no paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wheel {
    /// The mesh in the wheel's frame.
    pub mesh: TriangleMesh,
    /// Undeformed radius (m).
    pub radius: f64,
    /// Greatest distance of a vertex from the axle (m).
    pub outer_radius: f64,
    /// Extent along the axle (m).
    pub width: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Inertia about the wheel centre: xx, yy, zz (kg m2).
    pub inertia: [f64; 3],
    /// Friction, restitution, Young's modulus (Pa), Poisson's ratio.
    pub material: [f64; 4],
    /// Forces at vertices instead of the wrench.
    pub by_vertices: bool,
    /// What the user should know though it is no fault.
    pub notes: Vec<String>,
}

impl Wheel {
    /// Checks a specification and reads its files.
    ///
    /// # Errors
    /// All faults at once, with their JSON paths.
    pub fn build(spec: &Specification<RigidTire>) -> Result<Self, UnitError> {
        let mut faults = Faults::new();
        let RigidTire { shape, mass, material, contact } = &spec.value;
        check_material(&mut faults, material);
        check_mass(&mut faults, mass);
        let made = make_shape(&mut faults, shape, spec.folder.as_deref());
        let Some((mesh, radius)) = made else {
            faults.into_result(&spec.origin)?;
            return Err(UnitError::input(format!("{}: the shape cannot be made", spec.origin)));
        };
        let mut notes = Vec::new();
        let (m, inertia) = masses(&mut faults, &mut notes, mass, &mesh);
        faults.into_result(&spec.origin)?;
        let outer_radius = mesh.vertices.iter().map(|p| p[0].hypot(p[2])).fold(0.0, f64::max);
        let (low, high) = mesh.vertices.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[1]), h.max(p[1])));
        Ok(Self {
            radius: radius.unwrap_or(outer_radius),
            outer_radius,
            width: high - low,
            mass: m,
            inertia,
            material: [material.friction, material.restitution, material.young_modulus, material.poisson_ratio],
            by_vertices: *contact == ContactPath::Vertices,
            mesh,
            notes,
        })
    }
}

fn check_material(faults: &mut Faults, m: &Material) {
    faults.not_negative("material.friction", m.friction);
    faults.within("material.restitution", m.restitution, 0.0, 1.0);
    faults.positive("material.young_modulus", m.young_modulus);
    let nu = m.poisson_ratio;
    faults.check(nu > -1.0 && nu <= 0.5, "material.poisson_ratio", nu, "above -1, at most 0.5");
}

fn check_mass(faults: &mut Faults, m: &Mass) {
    match (m.mass, m.density) {
        (Some(x), None) => faults.positive("mass.mass", x),
        (None, Some(x)) => faults.positive("mass.density", x),
        (Some(_), Some(_)) => faults.add("'mass' has both 'mass' and 'density'; allowed: exactly one of them"),
        (None, None) => faults.add("'mass' has neither 'mass' nor 'density'; allowed: exactly one of them"),
    }
    if let Some(i) = m.inertia {
        for (axis, x) in [("xx", i.xx), ("yy", i.yy), ("zz", i.zz)] {
            faults.positive(&format!("mass.inertia.{axis}"), x);
        }
        // Sums of products of coordinates: no body of mass violates it.
        let possible = i.xx <= i.yy + i.zz && i.yy <= i.xx + i.zz && i.zz <= i.xx + i.yy;
        faults.check(
            possible,
            "mass.inertia",
            format!("({}, {}, {})", i.xx, i.yy, i.zz),
            "no moment greater than the sum of the other two",
        );
    }
}

/// The mesh and the undeformed radius, if the shape says one.
fn make_shape(faults: &mut Faults, shape: &Shape, folder: Option<&Path>) -> Option<(TriangleMesh, Option<f64>)> {
    match shape {
        Shape::Cylinder(c) => {
            let grousers =
                c.grousers.as_ref().map(|g| Grousers { count: g.count, height: g.height, thickness: g.thickness });
            let cylinder = Cylinder { radius: c.radius, width: c.width, divisions: c.divisions, grousers };
            match cylinder.mesh() {
                Ok(mesh) => Some((mesh, Some(c.radius))),
                Err(e) => {
                    faults.add(format!("'shape.cylinder': {e}"));
                    None
                }
            }
        }
        Shape::Obj(o) => {
            faults.positive("shape.obj.scale", o.scale);
            if let Some(r) = o.radius {
                faults.positive("shape.obj.radius", r);
            }
            match read_obj(o, folder) {
                Ok(mesh) => Some((mesh, o.radius)),
                Err(e) => {
                    faults.add(format!("'shape.obj.file' is {}: {e}", o.file));
                    None
                }
            }
        }
    }
}

fn read_obj(shape: &ObjShape, folder: Option<&Path>) -> Result<TriangleMesh, String> {
    let given = Path::new(&shape.file);
    let path = match folder {
        Some(folder) => folder.join(given),
        None if given.is_absolute() => given.to_path_buf(),
        None => return Err("a relative path needs a specification in a file or a resources folder".into()),
    };
    let text = std::fs::read_to_string(&path).map_err(|e| format!("cannot be read: {e}"))?;
    let mut mesh = obj::read(&text).map_err(|e| e.to_string())?;
    mesh.vertices.iter_mut().flatten().for_each(|x| *x *= shape.scale);
    let report = mesh.check();
    if !report.is_closed() {
        return Err(format!("the mesh has to be closed, wound outward and without faults:\n{report}"));
    }
    Ok(mesh)
}

/// Mass (kg) and moments about the wheel centre (kg m2).
fn masses(faults: &mut Faults, notes: &mut Vec<String>, given: &Mass, mesh: &TriangleMesh) -> (f64, [f64; 3]) {
    let solid = match mesh.mass_properties(given.density.filter(|d| d.is_finite() && *d > 0.0).unwrap_or(1.0)) {
        Ok(solid) => solid,
        Err(e) => {
            faults.add(format!("'shape': {e}"));
            return (0.0, [0.0; 3]);
        }
    };
    let mass = given.mass.unwrap_or(solid.mass);
    let inertia = match given.inertia {
        Some(i) => [i.xx, i.yy, i.zz],
        None => {
            let about = solid.inertia_about(&terramech_mechanics::Vec3::zeros()) * (mass / solid.mass);
            [about[(0, 0)], about[(1, 1)], about[(2, 2)]]
        }
    };
    // The hub carries mass and principal moments about the wheel centre only.
    let reach = mesh.bounds().map_or(0.0, |[lo, hi]| (hi - lo).norm());
    if solid.center.norm() > 0.01 * reach {
        notes.push(format!(
            "the solid's centre of mass is at {:?} m: the imbalance about the wheel centre is not modelled",
            solid.center.as_slice()
        ));
    }
    (mass, inertia)
}
