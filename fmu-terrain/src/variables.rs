//! Variables, the same for all terrains: the one source of their `modelDescription.xml`.

use crate::config::BODIES;
use terramech_fmi2::variables::{CommonVars, StateVars, WrenchVars};
use terramech_fmi2::{IntegerArrayVar, IntegerVar, RealArrayVar, RealVar, StringVar, Table, Var};

/// Handles of one body.
#[derive(Clone, Copy, Debug)]
pub struct BodyVars {
    /// `none`, `mesh`, `rigid_mesh` or `cylinder`.
    pub shape: StringVar,
    /// In: vertices (m).
    pub position: RealArrayVar,
    /// In: their velocities (m/s).
    pub velocity: RealArrayVar,
    /// In: triangles.
    pub triangle: IntegerArrayVar,
    /// In: state of a rigid mesh or cylinder; of a mesh, where its position is set, the point the wrench is about.
    pub state: StateVars,
    /// Radius of a cylinder (m).
    pub radius: RealVar,
    /// Width of a cylinder (m).
    pub width: RealVar,
    /// Friction, restitution, Young's modulus, Poisson's ratio.
    pub material: [RealVar; 4],
    /// Out: vertices with a force.
    pub contact_index: IntegerArrayVar,
    /// Out: forces on them (N).
    pub contact_force: RealArrayVar,
    /// Out: total force and moment about the body's centre.
    pub wrench: WrenchVars,
}

/// Handles of the obstacles' arrays, one obstacle after the other as in the specification.
#[derive(Clone, Copy, Debug)]
pub struct ObstacleVars {
    /// Centres of mass (m).
    pub position: RealArrayVar,
    /// Quaternions w, x, y, z.
    pub orientation: RealArrayVar,
    /// Velocities (m/s).
    pub velocity: RealArrayVar,
    /// Angular velocities (rad/s).
    pub angular_velocity: RealArrayVar,
    /// Forces on them, weight aside (N).
    pub force: RealArrayVar,
    /// Vertices of their surfaces (m).
    pub mesh_position: RealArrayVar,
    /// Triangles of their surfaces.
    pub mesh_triangle: IntegerArrayVar,
}

/// Handles of one set of probes: points in, the ground there out.
#[derive(Clone, Copy, Debug)]
pub struct ProbeVars {
    /// In: points x, y, z (m).
    pub position: RealArrayVar,
    /// Out: height there (m).
    pub height: RealArrayVar,
    /// Out: upward unit normal there.
    pub normal: RealArrayVar,
    /// Out: friction there.
    pub friction: RealArrayVar,
}

impl ProbeVars {
    /// Whether `vr` is one of the answers.
    pub fn answers(&self, vr: u32) -> bool {
        [self.height, self.normal, self.friction].iter().any(|p| p.vr() == vr)
    }
}

impl Variables {
    /// The set of probes, the common one or a body's, that `vr` is an answer of.
    pub fn probe_of(&self, vr: u32) -> Option<ProbeVars> {
        self.body_probe.iter().chain([&self.probe]).find(|p| p.answers(vr)).copied()
    }
}

/// Handles of all variables.
#[derive(Clone, Debug)]
pub struct Variables {
    /// `specification`, `threads`.
    pub common: CommonVars,
    /// File of a settled bed to start from.
    pub bed_load: StringVar,
    /// File to write the settled bed to.
    pub bed_save: StringVar,
    /// Parameter: where the bed goes when the run ends.
    pub bed_save_end: StringVar,
    /// Bodies.
    pub body: Vec<BodyVars>,
    /// Height of the settled bed (m).
    pub height: RealVar,
    /// Probes.
    pub probe: ProbeVars,
    /// Probes of each body, so that every tire can ask the ground by itself.
    pub body_probe: Vec<ProbeVars>,
    /// Out: grain numbers.
    pub grain_id: IntegerArrayVar,
    /// Out: positions (m).
    pub grain_position: RealArrayVar,
    /// Out: velocities (m/s).
    pub grain_velocity: RealArrayVar,
    /// Out: radii (m).
    pub grain_radius: RealArrayVar,
    /// Out: net contact forces (N).
    pub grain_force: RealArrayVar,
    /// Out: states and surfaces of the obstacles.
    pub obstacle: ObstacleVars,
    /// Out: kinetic energy of the grains (J).
    pub kinetic_energy: RealVar,
    /// Out: energy turned into heat since the bed was made (J).
    pub dissipated_energy: RealVar,
    /// Out: work of the bodies on the ground since the bed was made (J).
    pub body_work: RealVar,
    /// Parameter: angle of the slope (rad).
    pub slope: RealVar,
    /// Out: contacts.
    pub contact_count: IntegerVar,
    /// Out: grains.
    pub grain_count: IntegerVar,
    /// Out: inner steps of the last communication step.
    pub inner_steps: IntegerVar,
    /// Out: what an iterative solver did.
    pub solver: Option<SolverVars>,
}

/// Handles of what an iterative solver did.
#[derive(Clone, Copy, Debug)]
pub struct SolverVars {
    /// Iterations of the last inner step.
    pub iterations: IntegerVar,
    /// Residual there (m/s).
    pub residual: RealVar,
    /// Inner steps so far that ended above the tolerance.
    pub unconverged: IntegerVar,
}

/// Steepest slope (rad), either way: 45 degrees.
const STEEPEST: f64 = std::f64::consts::FRAC_PI_4;

/// Declares the table; `solver`: for a model that solves by iteration.
pub fn declare(solver: bool) -> (Table, Variables) {
    let mut t = Table::new();
    let common = t.common_parameters();
    let bed_load = t.parameter_string(
        "bed_load",
        "",
        "Absolute path of a settled bed to start from instead of settling one; empty for none",
    );
    let bed_save = t.parameter_string("bed_save", "", "Absolute path to write the settled bed to; empty for none");
    let bed_save_end = t.parameter_string(
        "bed_save_end",
        "",
        "Absolute path to write the bed to when the run ends, as the bodies left it: the next pass loads it; empty for none",
    );
    let slope = t.parameter_real(
        "slope",
        0.0,
        "rad",
        "Angle of the slope, uphill along X: gravity turns about Y once the bed has settled, X and Z stay along and normal to the slope. A rigid ground \
         has no weight of its own: there it changes nothing",
    );
    t.range(slope, Some(-STEEPEST), Some(STEEPEST));
    t.not_in_state(bed_save_end);
    t.not_in_state(bed_load);
    t.not_in_state(bed_save);
    let body = (1..=BODIES).map(|k| body(&mut t, k)).collect();
    let height = t.output_real(
        "height",
        "m",
        "Height of the settled bed: mean over square cells two mean diameters wide of the highest point of a grain in each",
    );
    t.depends_initially(height, &[common.specification.vr(), bed_load.vr()]);
    let initially = [common.specification.vr(), bed_load.vr()];
    let probe = probe(&mut t, "probe", initially);
    let grain_id =
        t.output_integer_array("grain.id", "Numbers of the grains, ascending: the order of all grain arrays");
    let grain_position = t.output_real_array("grain.position", "m", "Positions of the grains");
    let grain_velocity = t.output_real_array("grain.velocity", "m/s", "Velocities of the grains");
    let grain_radius = t.output_real_array("grain.radius", "m", "Radii of the grains");
    let grain_force = t.output_real_array(
        "grain.force",
        "N",
        "Net contact force on each grain at the last inner step of the last communication step",
    );
    t.on_demand(grain_id);
    t.depends_initially(grain_id, &[common.specification.vr(), bed_load.vr()]);
    for v in [grain_position, grain_velocity, grain_radius, grain_force] {
        t.on_demand(v);
        t.depends_initially(v, &[common.specification.vr(), bed_load.vr()]);
    }
    let obstacle = obstacles(&mut t, &[common.specification.vr(), bed_load.vr()]);
    let kinetic_energy = t.output_real("kinetic_energy", "J", "Kinetic energy of all grains, rotation included");
    let dissipated_energy = t.output_real(
        "dissipated_energy",
        "J",
        "Energy turned into heat since the bed was made: work of the bodies less the change of kinetic, potential and \
         elastic energy",
    );
    let body_work = t.output_real(
        "body_work",
        "J",
        "Work of the bodies on the ground since the bed was made: of the tires, and of obstacles on grains",
    );
    let contact_count = t.output_integer("contact_count", "Contacts of grains with grains, walls and bodies");
    let grain_count = t.output_integer("grain_count", "Number of grains");
    let inner_steps = t.output_integer("inner_steps", "Inner steps of the last communication step");
    for v in [kinetic_energy, dissipated_energy, body_work] {
        t.on_demand(v);
        t.depends_initially(v, &[common.specification.vr(), bed_load.vr()]);
    }
    t.on_demand(contact_count);
    for v in [contact_count, grain_count] {
        t.depends_initially(v, &[common.specification.vr(), bed_load.vr()]);
    }
    let body_probe = (1..=BODIES).map(|k| self::probe(&mut t, &format!("body[{k}].probe"), initially)).collect();
    let solver = solver.then(|| SolverVars {
        iterations: t.output_integer("solver.iterations", "Iterations of the solver in the last inner step"),
        residual: t.output_real(
            "solver.residual",
            "m/s",
            "Largest residual of a contact at the end of the last inner step",
        ),
        unconverged: t.output_integer("solver.unconverged", "Inner steps so far that ended above the tolerance"),
    });
    let vars = Variables {
        common,
        bed_load,
        slope,
        bed_save,
        bed_save_end,
        body,
        height,
        probe,
        body_probe,
        grain_id,
        grain_position,
        grain_velocity,
        grain_radius,
        grain_force,
        obstacle,
        kinetic_energy,
        dissipated_energy,
        body_work,
        contact_count,
        grain_count,
        inner_steps,
        solver,
    };
    (t, vars)
}

fn obstacles(t: &mut Table, from: &[u32]) -> ObstacleVars {
    let order = "one obstacle after the other, as in the specification";
    let mut real = |name: &str, unit, what: &str| t.output_real_array(&format!("obstacle.{name}"), unit, what);
    let position = real("position", "m", &format!("Centres of mass of the obstacles: {order}"));
    let orientation = real("orientation", "1", "Orientations of the obstacles, quaternions w, x, y, z");
    let velocity = real("velocity", "m/s", "Velocities of the obstacles");
    let angular_velocity = real("angular_velocity", "rad/s", "Angular velocities of the obstacles");
    let force = real(
        "force",
        "N",
        "Force on each obstacle at the last inner step, from soil, walls and bodies, without its weight",
    );
    let mesh_position = real("mesh.position", "m", "Vertices of the obstacles' surfaces, in the inertial frame");
    let mesh_triangle = t.output_integer_array("obstacle.mesh.triangle", "Triangles of the obstacles' surfaces");
    for v in [position, orientation, velocity, angular_velocity, force, mesh_position] {
        t.on_demand(v);
        t.depends_initially(v, from);
    }
    t.on_demand(mesh_triangle);
    t.depends_initially(mesh_triangle, from);
    ObstacleVars { position, orientation, velocity, angular_velocity, force, mesh_position, mesh_triangle }
}

/// A set of probes.
fn probe(t: &mut Table, prefix: &str, [specification, bed_load]: [u32; 2]) -> ProbeVars {
    let name = |n: &str| format!("{prefix}.{n}");
    let position = t.input_real_array(&name("position"), "m", "Points to probe, x0, y0, z0, x1, ... (z is not used)");
    let height = t.output_real_array(&name("height"), "m", "Height of the ground at each point now; 0 outside the box");
    let normal = t.output_real_array(
        &name("normal"),
        "1",
        "Upward unit normal of the ground at each point, x0, y0, z0, x1, ...",
    );
    let friction = t.output_real_array(&name("friction"), "1", "Coefficient of friction of the ground at each point");
    for v in [height, normal, friction] {
        t.on_demand(v);
        t.depends_initially(v, &[specification, bed_load, position.vr()]);
    }
    ProbeVars { position, height, normal, friction }
}

fn body(t: &mut Table, k: usize) -> BodyVars {
    let prefix = format!("body[{k}]");
    let name = |n: &str| format!("{prefix}.{n}");
    let shape = t.parameter_string(
        &name("shape"),
        "none",
        "none; mesh: position, velocity and triangle before every step; rigid_mesh: position and triangle once, in the \
         inertial frame at the state of the end of initialization, then the state; cylinder: state, radius, width, axis along \
         the body's y",
    );
    let position = t.input_real_array(&name("position"), "m", "Vertices, x0, y0, z0, x1, ..., in the inertial frame");
    let velocity = t.input_real_array(&name("velocity"), "m/s", "Velocities of the vertices, in the inertial frame");
    let triangle = t.input_integer_array(&name("triangle"), "Vertices of the triangles, counted from 0, wound outward");
    let state = t.state(&prefix, false, "the body");
    let radius = t.parameter_real(&name("radius"), 0.0, "m", "Radius of a cylinder");
    let width = t.parameter_real(&name("width"), 0.0, "m", "Width of a cylinder along its axis");
    let replaces = "; where it is set, it replaces bodies.surface of the specification";
    let surface = crate::config::Surface::default();
    let mut real = |n: &str, start: f64, unit, text: &str| {
        t.parameter_real(&name(&format!("material.{n}")), start, unit, &format!("{text} of the surface{replaces}"))
    };
    let material = [
        real("friction", surface.friction, "1", "Coefficient of friction"),
        real("restitution", surface.restitution, "1", "Coefficient of restitution"),
        real("young_modulus", surface.young_modulus, "Pa", "Young's modulus"),
        real("poisson_ratio", surface.poisson_ratio, "1", "Poisson's ratio"),
    ];
    t.range(radius, Some(0.0), None);
    t.range(width, Some(0.0), None);
    t.range(material[0], Some(0.0), Some(100.0));
    t.range(material[1], Some(0.0), Some(1.0));
    t.range(material[3], Some(-0.99), Some(0.5));
    let contact_index = t.output_integer_array(
        &name("contact.index"),
        "Vertices with a contact force, counted from 0, ascending, unique",
    );
    let contact_force = t.output_real_array(
        &name("contact.force"),
        "N",
        "Forces on these vertices, means over the last communication step, in the inertial frame",
    );
    let wrench =
        t.wrench(&prefix, true, "the body from the soil, about its centre, mean over the last communication step");
    BodyVars {
        shape,
        position,
        velocity,
        triangle,
        state,
        radius,
        width,
        material,
        contact_index,
        contact_force,
        wrench,
    }
}
