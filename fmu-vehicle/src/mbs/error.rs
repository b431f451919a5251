//! What can be wrong with a multibody model, or go wrong in its solution.

/// Faults of the multibody core. The first group is the user's (a model that cannot exist), the rest numerical.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MbsError {
    /// A body without mass or with an inertia that no body has.
    #[error("body '{body}': {what} is {given}; allowed: {allowed}")]
    Body {
        /// Name of the body.
        body: String,
        /// The quantity.
        what: &'static str,
        /// The value given.
        given: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Geometry that defines no joint: an axis of zero length, a rod between coincident points.
    #[error("joint '{joint}': {what}")]
    Geometry {
        /// Name of the joint.
        joint: String,
        /// What is wrong.
        what: String,
    },
    /// The joints cannot all close.
    #[error(
        "the assembly does not close: joint '{joint}' stays open by {residual:.3e} {unit} after {iterations} Newton iterations \
         (allowed {tolerance:.0e}); check the points and lengths of this joint and of those it forms a loop with"
    )]
    DoesNotClose {
        /// The joint with the largest gap.
        joint: String,
        /// The gap.
        residual: f64,
        /// Its unit, m or rad.
        unit: &'static str,
        /// Iterations done.
        iterations: usize,
        /// Gap allowed.
        tolerance: f64,
    },
    /// Joints that constrain the same motion twice.
    #[error(
        "{count} redundant constraint{s}: {list}; a motion is constrained twice, so that reaction forces are undefined (replace a \
         joint of the loop by one with fewer constraints: a spherical joint for a revolute one, a distance for a rod)",
        s = if *count == 1 { "" } else { "s" }
    )]
    Redundant {
        /// How many rows too many.
        count: usize,
        /// "joint 'a' (row 4 of 5) repeats 'b', 'c'".
        list: String,
    },
    /// Shaft constraints that contradict or repeat each other.
    #[error("shaft constraint '{0}' repeats or contradicts the others")]
    Shafts(String),
    /// The factorisation met a singular matrix: a dead position.
    #[error("the joints of '{joint}' have become dependent (a dead position of the mechanism) at t = {time} s")]
    Singular {
        /// A joint of the cluster.
        joint: String,
        /// When (s).
        time: f64,
    },
    /// The positions could not be brought onto the constraints within a step.
    #[error(
        "joint '{joint}' opened by {residual:.3e} at t = {time} s and did not close in {iterations} iterations: the step of {step} s is \
         too long for this motion"
    )]
    NoConvergence {
        /// The joint with the largest gap.
        joint: String,
        /// The gap (m or rad).
        residual: f64,
        /// When (s).
        time: f64,
        /// Iterations done.
        iterations: usize,
        /// The step (s).
        step: f64,
    },
    /// A velocity is not finite.
    #[error("the velocity of body '{body}' is not finite at t = {time} s")]
    NotFinite {
        /// Name of the body.
        body: String,
        /// When (s).
        time: f64,
    },
}

impl MbsError {
    /// The element of a vehicle's specification that the fault points to, by the name of its joint or body: `axles[0].suspension`,
    /// `steering[0]`, `axles[1].wheel.tire_radius`.
    pub fn specification_path(&self) -> Option<String> {
        let text = match self {
            Self::Body { body, .. } => body,
            Self::Geometry { joint, .. } | Self::DoesNotClose { joint, .. } | Self::NoConvergence { joint, .. } => {
                joint
            }
            Self::Redundant { list, .. } => list,
            Self::Shafts(_) => return Some("driveline".into()),
            Self::Singular { .. } | Self::NotFinite { .. } => return None,
        };
        let number = |word: &str| -> Option<usize> {
            let rest = &text[text.find(word)? + word.len()..];
            rest.split(|c: char| !c.is_ascii_digit()).next()?.parse::<usize>().ok()?.checked_sub(1)
        };
        if let Some(wheel) = number("support of wheel ") {
            return Some(format!("axles[{}].wheel.tire_radius", wheel / 2));
        }
        // The axle first: a tie rod belongs to both.
        number("axle ")
            .map(|k| format!("axles[{k}].suspension"))
            .or_else(|| number("steering ").map(|k| format!("steering[{k}]")))
            .or_else(|| text.contains("chassis").then(|| "chassis".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_point_to_their_element() {
        let open = |joint: &str| MbsError::DoesNotClose {
            joint: joint.into(),
            residual: 1.0,
            unit: "m",
            iterations: 3,
            tolerance: 1e-9,
        };
        assert_eq!(open("axle 2 left tie rod").specification_path().unwrap(), "axles[1].suspension");
        assert_eq!(open("steering 1 idler").specification_path().unwrap(), "steering[0]");
        assert_eq!(open("support of wheel 3").specification_path().unwrap(), "axles[1].wheel.tire_radius");
        let twice = MbsError::Redundant { count: 1, list: "joint 'axle 1 right tie rod' repeats what ...".into() };
        assert_eq!(twice.specification_path().unwrap(), "axles[0].suspension");
    }
}
