//! Variables of the flexible tire: the one source of its `modelDescription.xml`.

use terramech_fmi2::variables::{CommonVars, StateVars, WrenchVars};
use terramech_fmi2::{IntegerArrayVar, RealArrayVar, RealVar, StringVar, Table, Var};

/// Handles of all variables.
#[derive(Clone, Copy, Debug)]
pub struct Variables {
    /// `specification`, `threads`.
    pub common: CommonVars,
    /// `none` or `plane`.
    pub ground: StringVar,
    /// Height of the plane (m).
    pub plane_height: RealVar,
    /// Gravity along Z (m/s2).
    pub gravity: RealVar,
    /// Angle of the slope (rad).
    pub slope: RealVar,
    /// In: state of the wheel.
    pub wheel_state: StateVars,
    /// In: vertices in contact.
    pub contact_index: IntegerArrayVar,
    /// In: forces on them (N).
    pub contact_force: RealArrayVar,
    /// Out: what acts on the hub.
    pub wheel_wrench: WrenchVars,
    /// Out: vertices in the inertial frame (m).
    pub mesh_position: RealArrayVar,
    /// Out: their velocities (m/s).
    pub mesh_velocity: RealArrayVar,
    /// Out: triangles.
    pub mesh_triangle: IntegerArrayVar,
    /// Out: strains per element, circumferential, radial, shear.
    pub mesh_strain: RealArrayVar,
    /// Out: the same per vertex.
    pub mesh_vertex_strain: RealArrayVar,
    /// Out: compliance per vertex (m/N).
    pub mesh_compliance: RealArrayVar,
    /// Mass handed to the hub (kg).
    pub hub_mass: RealVar,
    /// Moments handed to the hub: xx, yy, zz (kg m2).
    pub hub_inertia: [RealVar; 3],
    /// Undeformed radius, largest distance from the axle when inflated, width (m).
    pub sizes: [RealVar; 3],
    /// Friction, restitution, Young's modulus, Poisson's ratio.
    pub material: [RealVar; 4],
    /// Out: deflection (m), patch area (m2), force of the plane along Z (N).
    pub contact: [RealVar; 3],
    /// Out: strain energy, kinetic energy, work of the pressure since inflation, dissipated energy, work of the ground (J).
    pub energies: [RealVar; 5],
}

/// Declares the table.
pub fn declare() -> (Table, Variables) {
    let mut t = Table::new();
    let common = t.common_parameters();
    let ground =
        t.parameter_string("ground", "none", "Ground of the tire's own: none, or plane (rigid and horizontal)");
    let plane_height = t.parameter_real("plane.height", 0.0, "m", "Height of the plane, if ground is plane");
    let gravity = t.parameter_real("gravity", -9.81, "m/s2", "Gravity along Z, on level ground");
    let slope = t.parameter_real("slope", 0.0, "rad", "Angle of the slope, uphill along X: gravity is turned about Y");
    t.range(slope, Some(-std::f64::consts::FRAC_PI_4), Some(std::f64::consts::FRAC_PI_4));
    let wheel_state = t.state("wheel", false, "the wheel");
    let contact_index =
        t.input_integer_array("contact.index", "Vertices with a contact force, counted from 0, ascending and unique");
    let contact_force = t.input_real_array(
        "contact.force",
        "N",
        "Forces on these vertices, x0, y0, z0, x1, ..., in the inertial frame",
    );
    let wheel_wrench = t.wrench("wheel", true, "the hub from the tire, about the wheel centre");
    let mesh_position =
        t.output_real_array("mesh.position", "m", "Vertices, x0, y0, z0, x1, ..., in the inertial frame");
    let mesh_velocity =
        t.output_real_array("mesh.velocity", "m/s", "Velocities of the vertices, in the inertial frame");
    let mesh_triangle = t.output_integer_array(
        "mesh.triangle",
        "Vertices of the triangles, counted from 0, wound outward; two per element, then a strip that closes the mesh at the rim, then the walls of lugs",
    );
    t.fixed(mesh_triangle);
    let mesh_strain = t.output_real_array(
        "mesh.strain",
        "1",
        "Strain of the mid-surface in the middle of each element: circumferential, radial (across), shear",
    );
    t.on_demand(mesh_strain);
    let mesh_vertex_strain = t.output_real_array(
        "mesh.vertex_strain",
        "1",
        "The same at each vertex, mean over the elements around it: for pictures",
    );
    t.on_demand(mesh_vertex_strain);
    let mesh_compliance = t.output_real_array(
        "mesh.compliance",
        "m/N",
        "Estimated displacement of each vertex per force held over one inner step; 0 on the rim",
    );
    t.fixed(mesh_compliance);
    let hub_mass =
        t.calculated_real("hub.mass", "kg", "Mass that the vehicle integrates with the wheel: all of the tire's");
    let hub_inertia = ["xx", "yy", "zz"].map(|axis| {
        t.calculated_real(
            &format!("hub.inertia.{axis}"),
            "kg.m2",
            "Moment of inertia about the wheel centre handed to the hub",
        )
    });
    let sizes = [
        t.calculated_real("radius", "m", "Undeformed radius: the radius of slip and sinkage"),
        t.calculated_real(
            "outer_radius",
            "m",
            "Greatest distance of the inflated surface, lugs included, from the axle",
        ),
        t.calculated_real("width", "m", "Width along the axle"),
    ];
    let material = [
        t.calculated_real("material.friction", "1", "Coefficient of friction of the surface"),
        t.calculated_real("material.restitution", "1", "Coefficient of restitution of the surface"),
        t.calculated_real("material.young_modulus", "Pa", "Young's modulus of the surface"),
        t.calculated_real("material.poisson_ratio", "1", "Poisson's ratio of the surface"),
    ];
    let contact = [
        t.output_real("deflection", "m", "Largest inward movement of the crown against the inflated shape"),
        t.output_real("patch_area", "m2", "Undeformed area of the surface in contact"),
        t.output_real("plane.force", "N", "Force of the tire's own plane on it, along Z"),
    ];
    let energies = [
        t.output_real("strain_energy", "J", "Strain energy"),
        t.output_real("kinetic_energy", "J", "Kinetic energy"),
        t.output_real("pressure_work", "J", "Work of the pressure since inflation"),
        t.output_real("dissipated_energy", "J", "Energy dissipated by the structural damping since initialization"),
        t.output_real(
            "ground_work",
            "J",
            "Work of the ground on the tire since initialization: plane and vertex forces",
        ),
    ];
    for v in contact.into_iter().chain(energies) {
        t.on_demand(v);
    }
    let specification = common.specification.vr();
    for v in [hub_mass].into_iter().chain(hub_inertia).chain(sizes).chain(material) {
        t.depends_initially(v, &[specification]);
    }
    for v in [mesh_position, mesh_velocity] {
        t.depends_initially(v, &wheel_state.all());
        t.depends_initially(v, &[specification]);
    }
    t.depends_initially(mesh_triangle, &[specification]);
    t.depends_initially(mesh_compliance, &[specification]);
    let vars = Variables {
        common,
        ground,
        plane_height,
        gravity,
        slope,
        wheel_state,
        contact_index,
        contact_force,
        wheel_wrench,
        mesh_position,
        mesh_velocity,
        mesh_triangle,
        mesh_strain,
        mesh_vertex_strain,
        mesh_compliance,
        hub_mass,
        hub_inertia,
        sizes,
        material,
        contact,
        energies,
    };
    (t, vars)
}
