//! Variables of the rigid tire: the one source of its `modelDescription.xml`.

use terramech_fmi2::variables::{CommonVars, StateVars, WrenchVars};
use terramech_fmi2::{IntegerArrayVar, RealArrayVar, RealVar, Table, Var};

/// Handles of all variables.
#[derive(Clone, Copy, Debug)]
pub struct Variables {
    /// `specification`, `threads`.
    pub common: CommonVars,
    /// In: state of the wheel.
    pub wheel_state: StateVars,
    /// In: the terrain's wrench on the wheel, about its centre.
    pub contact: WrenchVars,
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
    /// Mass handed to the hub (kg).
    pub hub_mass: RealVar,
    /// Moments handed to the hub: xx, yy, zz (kg m2).
    pub hub_inertia: [RealVar; 3],
    /// Undeformed radius (m).
    pub radius: RealVar,
    /// Greatest distance from the axle (m).
    pub outer_radius: RealVar,
    /// Width (m).
    pub width: RealVar,
    /// Friction, restitution, Young's modulus, Poisson's ratio.
    pub material: [RealVar; 4],
}

/// Declares the table.
pub fn declare() -> (Table, Variables) {
    let mut t = Table::new();
    let common = t.common_parameters();
    let wheel_state = t.state("wheel", false, "the wheel");
    let contact = t.wrench("contact", false, "the wheel from the terrain, about the wheel centre");
    let contact_index = t.input_integer_array(
        "contact.index",
        "Vertices with a contact force, counted from 0, ascending and unique (used when the specification's contact is vertices)",
    );
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
    let mesh_triangle =
        t.output_integer_array("mesh.triangle", "Vertices of the triangles, counted from 0, wound outward");
    t.fixed(mesh_triangle);
    t.depends_initially(mesh_position, &wheel_state.all());
    t.depends_initially(mesh_velocity, &wheel_state.all());
    let hub_mass =
        t.calculated_real("hub.mass", "kg", "Mass that the vehicle integrates with the wheel: all of the tire's");
    let hub_inertia = ["xx", "yy", "zz"].map(|axis| {
        t.calculated_real(
            &format!("hub.inertia.{axis}"),
            "kg.m2",
            "Moment of inertia about the wheel centre handed to the hub",
        )
    });
    let radius =
        t.calculated_real("radius", "m", "Undeformed radius, without grousers: the radius of slip and sinkage");
    let outer_radius =
        t.calculated_real("outer_radius", "m", "Greatest distance of the surface from the axle, grousers included");
    let width = t.calculated_real("width", "m", "Width along the axle");
    let material = [
        t.calculated_real("material.friction", "1", "Coefficient of friction of the surface"),
        t.calculated_real("material.restitution", "1", "Coefficient of restitution of the surface"),
        t.calculated_real("material.young_modulus", "Pa", "Young's modulus of the surface"),
        t.calculated_real("material.poisson_ratio", "1", "Poisson's ratio of the surface"),
    ];
    // The specification is a known like any other.
    for v in [hub_mass, radius, outer_radius, width].into_iter().chain(hub_inertia).chain(material) {
        t.depends_initially(v, &[common.specification.vr()]);
    }
    for vr in [mesh_position, mesh_velocity] {
        t.depends_initially(vr, &[common.specification.vr()]);
    }
    t.depends_initially(mesh_triangle, &[common.specification.vr()]);
    let vars = Variables {
        common,
        wheel_state,
        contact,
        contact_index,
        contact_force,
        wheel_wrench,
        mesh_position,
        mesh_velocity,
        mesh_triangle,
        hub_mass,
        hub_inertia,
        radius,
        outer_radius,
        width,
        material,
    };
    (t, vars)
}
