//! The element `Algorithm` of our annotation: how units are coupled in time.
//!
//! ```xml
//! <tm:Algorithm scheme="gauss-seidel" order="rig tire terrain" resolveFeedThrough="true"/>
//! ```

use crate::decimal::Decimal;
use crate::fault::{FaultKind, Faults, Place};
use crate::xml::Element;
use crate::xml::write::Writer;

/// How units are coupled in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// All outputs are read, then all inputs set, then all units step side by side.
    #[default]
    Jacobi,
    /// One unit after the other, each with the newest values of those before it.
    GaussSeidel,
    /// Steps are repeated until inputs and outputs agree (units must save their state).
    Iterated,
    /// Jacobi with a step that follows the energy residual of the power bonds.
    Ecco,
}

impl Scheme {
    /// The words a file or the command line may give.
    pub const ALLOWED: &'static str = "jacobi, gauss-seidel, iterated or ecco";

    /// The word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jacobi => "jacobi",
            Self::GaussSeidel => "gauss-seidel",
            Self::Iterated => "iterated",
            Self::Ecco => "ecco",
        }
    }

    /// Reads a word.
    pub fn of(word: &str) -> Option<Self> {
        [Self::Jacobi, Self::GaussSeidel, Self::Iterated, Self::Ecco].into_iter().find(|s| s.name() == word)
    }
}

/// `Algorithm`.
#[derive(Clone, Debug, PartialEq)]
pub struct Algorithm {
    /// Which one.
    pub scheme: Scheme,
    /// Gauss-Seidel: all components in the order they step; empty = sources of initial values first.
    pub order: Vec<String>,
    /// Whether outputs that depend directly on inputs are read again, in the order of the initial exchange, before the step.
    pub resolve_feed_through: bool,
    /// Iterated: largest change of an input, relative to its largest value so far, between the last two iterations. ECCO: largest energy residual of a step,
    /// relative to the energy that passes.
    pub tolerance: Option<f64>,
    /// Iterated: most iterations of a step.
    pub iterations: Option<u32>,
    /// ECCO: longest step (s).
    pub longest: Option<Decimal>,
    /// Where it is written.
    pub place: Place,
}

impl Algorithm {
    /// Reads the element.
    pub fn read(e: Element<'_>, faults: &mut Faults) -> Option<Self> {
        e.required("scheme", faults)?;
        let scheme = e.parsed("scheme", Scheme::ALLOWED, faults, Scheme::of)?;
        let order: Vec<String> =
            e.attribute("order").unwrap_or_default().split_whitespace().map(str::to_owned).collect();
        if !order.is_empty() && scheme != Scheme::GaussSeidel {
            e.bad_value("order", &order.join(" "), "only with scheme=\"gauss-seidel\"", faults);
        }
        let resolve = e.parsed("resolveFeedThrough", "true or false", faults, crate::xml::boolean).unwrap_or(false);
        let tolerance = e.parsed("tolerance", "a number above 0 and below 1", faults, |t| {
            t.parse::<f64>().ok().filter(|x| *x > 0.0 && *x < 1.0)
        });
        let iterations = e.parsed("iterations", "a whole number from 1 to 1000", faults, |t| {
            t.parse::<u32>().ok().filter(|n| (1..=1000).contains(n))
        });
        let longest = super::annotations::time(e, "longest", true, faults);
        if longest.is_some() && scheme != Scheme::Ecco {
            e.bad_value("longest", e.attribute("longest").unwrap_or_default(), "only with scheme=\"ecco\"", faults);
        }
        Some(Self { scheme, order, resolve_feed_through: resolve, tolerance, iterations, longest, place: e.place() })
    }

    /// Writes the element.
    pub fn write(&self, writer: &mut Writer) {
        writer.open("tm:Algorithm").attribute("scheme", self.scheme.name());
        let order = (!self.order.is_empty()).then(|| self.order.join(" "));
        writer.optional("order", order.as_ref());
        writer.optional("resolveFeedThrough", self.resolve_feed_through.then_some("true"));
        writer.optional("tolerance", self.tolerance).optional("iterations", self.iterations);
        writer.optional("longest", self.longest).close();
    }

    /// A second one in the same description.
    pub(super) fn twice(&self, faults: &mut Faults) {
        let kind = FaultKind::Duplicate { what: "element", name: "Algorithm".into(), first: self.place.line };
        faults.add(&self.place, "Algorithm", kind);
    }
}
