//! Magic Formula, Pacejka 2002 (H. B. Pacejka, Tyre and Vehicle Dynamics, 2002, 4.3.2; the keys of PAC2002 `.tir` files).
//!
//! Steady-state combined slip with the weighting functions G, pneumatic trail and residual moment; transient slip by the relaxation
//! lengths of the file. Left out: belt dynamics, gyroscopic couple, effects of pressure.

use crate::tir::{Tir, TirError};
use crate::{Contact, TireForces};
use terramech_mechanics::Vec3;

macro_rules! parameters {
    (required: $($r:ident),*; optional: $($o:ident = $d:expr),*) => {
        /// Coefficients by their names in the file, in lower case.
        #[allow(missing_docs)]
        #[derive(Clone, Debug, PartialEq)]
        pub struct Pac02 { $(pub $r: f64,)* $(pub $o: f64,)* /// Measured on the left side.
            pub left: bool }
        impl Pac02 {
            /// Reads a `.tir` file's text.
            ///
            /// # Errors
            /// [`TirError`]: all missing keys at once, or values that cannot be.
            pub fn parse(text: &str) -> Result<Self, TirError> {
                let t = Tir::parse(text)?;
                let mut missing: Vec<String> = Vec::new();
                $(let $r = t.number(&stringify!($r).to_uppercase()).unwrap_or_else(|| { missing.push(stringify!($r).to_uppercase()); 0.0 });)*
                $(let $o = t.number(&stringify!($o).to_uppercase()).unwrap_or($d);)*
                if !missing.is_empty() { return Err(TirError::Missing(missing.join(", "))); }
                let left = t.text("TYRESIDE").is_none_or(|s| !s.eq_ignore_ascii_case("right"));
                let p = Self { $($r,)* $($o,)* left };
                for (key, x) in [("UNLOADED_RADIUS", p.unloaded_radius), ("FNOMIN", p.fnomin), ("VERTICAL_STIFFNESS", p.vertical_stiffness)] {
                    if x <= 0.0 { return Err(TirError::Value { key: key.into(), value: x.to_string(), allowed: "a number above 0" }); }
                }
                Ok(p)
            }
        }
    };
}

parameters! {
    required: unloaded_radius, vertical_stiffness, vertical_damping, fnomin,
        pcx1, pdx1, pdx2, pex1, pex2, pkx1, pkx2, pkx3, pcy1, pdy1, pdy2, pey1, pey2, pky1, pky2;
    optional: longvl = 16.7, pdx3 = 0.0, pex3 = 0.0, pex4 = 0.0, phx1 = 0.0, phx2 = 0.0, pvx1 = 0.0, pvx2 = 0.0,
        rbx1 = 0.0, rbx2 = 0.0, rcx1 = 1.0, rhx1 = 0.0, rex1 = 0.0, rex2 = 0.0, ptx1 = 0.0, ptx2 = 0.0, ptx3 = 0.0,
        pdy3 = 0.0, pey3 = 0.0, pey4 = 0.0, pky3 = 0.0, phy1 = 0.0, phy2 = 0.0, phy3 = 0.0, pvy1 = 0.0, pvy2 = 0.0,
        pvy3 = 0.0, pvy4 = 0.0, rby1 = 0.0, rby2 = 0.0, rby3 = 0.0, rcy1 = 1.0, rhy1 = 0.0, rhy2 = 0.0, rey1 = 0.0,
        rey2 = 0.0, rvy1 = 0.0, rvy2 = 0.0, rvy3 = 0.0, rvy4 = 0.0, rvy5 = 0.0, rvy6 = 0.0, pty1 = 0.0, pty2 = 1.0,
        qsx1 = 0.0, qsx2 = 0.0, qsx3 = 0.0, qsy1 = 0.0, qsy2 = 0.0, qsy3 = 0.0, qsy4 = 0.0,
        qbz1 = 0.0, qbz2 = 0.0, qbz3 = 0.0, qbz4 = 0.0, qbz5 = 0.0, qbz9 = 0.0, qbz10 = 0.0, qcz1 = 1.0,
        qdz1 = 0.0, qdz2 = 0.0, qdz3 = 0.0, qdz4 = 0.0, qdz6 = 0.0, qdz7 = 0.0, qdz8 = 0.0, qdz9 = 0.0,
        qez1 = 0.0, qez2 = 0.0, qez3 = 0.0, qez4 = 0.0, qez5 = 0.0, qhz1 = 0.0, qhz2 = 0.0, qhz3 = 0.0, qhz4 = 0.0,
        ssz1 = 0.0, ssz2 = 0.0, ssz3 = 0.0, ssz4 = 0.0,
        lfzo = 1.0, lcx = 1.0, lex = 1.0, lkx = 1.0, lhx = 1.0, lvx = 1.0, lmux = 1.0, lcy = 1.0, ley = 1.0, lky = 1.0,
        lhy = 1.0, lvy = 1.0, lmuy = 1.0, lgay = 1.0, lgaz = 1.0, ltr = 1.0, lres = 1.0, lxal = 1.0, lyka = 1.0,
        lvyka = 1.0, ls = 1.0, lmx = 1.0, lmy = 1.0, lsgkp = 1.0, lsgal = 1.0, lcz = 1.0
}

/// `D sin(C atan(B x - E (B x - atan(B x))))`.
fn magic(b: f64, c: f64, d: f64, e: f64, x: f64) -> f64 {
    let bx = b * x;
    d * (c * (bx - e * (bx - bx.atan())).atan()).sin()
}

/// The cosine version of [`magic`].
fn hill(b: f64, c: f64, e: f64, x: f64) -> f64 {
    let bx = b * x;
    (c * (bx - e * (bx - bx.atan())).atan()).cos()
}

/// Friction the coefficients belong to.
const REFERENCE_FRICTION: f64 = 0.8;

impl Pac02 {
    /// The HMMWV's tire.
    ///
    /// # Panics
    /// Never: the data come with the library.
    pub fn hmmwv() -> Self {
        Self::parse(include_str!("../data/HMMWV_Pac02Tire.tir")).expect("shipped data")
    }
    pub(crate) fn radius(&self) -> f64 {
        self.unloaded_radius
    }
    pub(crate) fn load(&self, c: &Contact) -> f64 {
        (self.vertical_stiffness * self.lcz * c.depth + self.vertical_damping * c.depth_rate).max(0.0)
    }
    pub(crate) fn relaxation(&self, load: f64, camber: f64) -> [f64; 2] {
        let fz0 = self.fnomin * self.lfzo;
        let dfz = (load - fz0) / fz0;
        let r = self.unloaded_radius;
        let x = load * (self.ptx1 + self.ptx2 * dfz) * (self.ptx3 * dfz).exp() * r / self.fnomin * self.lsgkp;
        let y = self.pty1
            * (2.0 * (load / (self.pty2 * fz0)).atan()).sin()
            * (1.0 - self.pky3 * camber.abs())
            * r
            * self.lfzo
            * self.lsgal;
        [x.abs(), y.abs()]
    }

    pub(crate) fn saturation(&self, load: f64) -> [f64; 2] {
        // Three times the slip at which the initial slopes reach the peaks.
        let fz0 = self.fnomin * self.lfzo;
        let ky = self.pky1 * fz0 * (2.0 * (load / (self.pky2 * fz0)).atan()).sin();
        [3.0 * self.pdx1 / self.pkx1.abs(), 3.0 * self.pdy1 * load / ky.abs()]
    }

    pub(crate) fn forces(&self, c: &Contact, load: f64, (kappa, tan_alpha): (f64, f64), side: f64) -> TireForces {
        // The file describes one side; the other is its mirror image.
        let mirror = if (side > 0.0) == self.left { 1.0 } else { -1.0 };
        let f =
            self.steady(load, kappa, mirror * tan_alpha.atan(), mirror * c.camber, c.friction / REFERENCE_FRICTION, c);
        TireForces {
            force: Vec3::new(f.force.x, mirror * f.force.y, load),
            moment: Vec3::new(mirror * f.moment.x, f.moment.y, mirror * f.moment.z),
        }
    }

    /// Steady-state forces for load (N), slips (slip angle and camber in rad) and a factor on friction.
    pub fn steady(&self, fz: f64, kappa: f64, alpha: f64, gamma: f64, friction: f64, c: &Contact) -> TireForces {
        let fz0 = self.fnomin * self.lfzo;
        let dfz = (fz - fz0) / fz0;
        let (lmux, lmuy) = (self.lmux * friction, self.lmuy * friction);
        // Along, pure.
        let shx = (self.phx1 + self.phx2 * dfz) * self.lhx;
        let kx = kappa + shx;
        let cx = self.pcx1 * self.lcx;
        let dx = (self.pdx1 + self.pdx2 * dfz) * (1.0 - self.pdx3 * gamma * gamma) * lmux * fz;
        let ex = ((self.pex1 + self.pex2 * dfz + self.pex3 * dfz * dfz) * (1.0 - self.pex4 * kx.signum()) * self.lex)
            .min(1.0);
        let kxk = fz * (self.pkx1 + self.pkx2 * dfz) * (self.pkx3 * dfz).exp() * self.lkx;
        let svx = fz * (self.pvx1 + self.pvx2 * dfz) * self.lvx * lmux;
        let fx0 = magic(kxk / (cx * dx), cx, dx, ex, kx) + svx;
        // Across, pure.
        let gy = gamma * self.lgay;
        let shy = (self.phy1 + self.phy2 * dfz) * self.lhy + self.phy3 * gy;
        let ay = alpha + shy;
        let cy = self.pcy1 * self.lcy;
        let dy = (self.pdy1 + self.pdy2 * dfz) * (1.0 - self.pdy3 * gy * gy) * lmuy * fz;
        let ey =
            ((self.pey1 + self.pey2 * dfz) * (1.0 - (self.pey3 + self.pey4 * gy) * ay.signum()) * self.ley).min(1.0);
        let ky = self.pky1
            * self.fnomin
            * (2.0 * (fz / (self.pky2 * fz0)).atan()).sin()
            * self.lfzo
            * self.lky
            * (1.0 - self.pky3 * gy.abs());
        let by = ky / (cy * dy);
        let svy = fz * ((self.pvy1 + self.pvy2 * dfz) * self.lvy + (self.pvy3 + self.pvy4 * dfz) * gy) * lmuy;
        let fy0 = magic(by, cy, dy, ey, ay) + svy;
        // Combined.
        let bxa = self.rbx1 * (self.rbx2 * kappa).atan().cos() * self.lxal;
        let exa = (self.rex1 + self.rex2 * dfz).min(1.0);
        let gxa = hill(bxa, self.rcx1, exa, alpha + self.rhx1) / hill(bxa, self.rcx1, exa, self.rhx1);
        let fx = fx0 * gxa;
        let byk = self.rby1 * (self.rby2 * (alpha - self.rby3)).atan().cos() * self.lyka;
        let eyk = (self.rey1 + self.rey2 * dfz).min(1.0);
        let shyk = self.rhy1 + self.rhy2 * dfz;
        let gyk = hill(byk, self.rcy1, eyk, kappa + shyk) / hill(byk, self.rcy1, eyk, shyk);
        let dvyk = dy * (self.rvy1 + self.rvy2 * dfz + self.rvy3 * gamma) * (self.rvy4 * alpha).atan().cos();
        let svyk = dvyk * (self.rvy5 * (self.rvy6 * kappa).atan()).sin() * self.lvyka;
        let fy = gyk * fy0 + svyk;
        // Aligning moment: trail and residual.
        let gz = gamma * self.lgaz;
        let r = self.unloaded_radius;
        let sht = self.qhz1 + self.qhz2 * dfz + (self.qhz3 + self.qhz4 * dfz) * gz;
        let ratio = kxk / ky * kappa;
        let equivalent = |a: f64| (a.tan().powi(2) + ratio * ratio).sqrt().atan() * a.signum();
        let at = equivalent(alpha + sht);
        let bt = (self.qbz1 + self.qbz2 * dfz + self.qbz3 * dfz * dfz)
            * (1.0 + self.qbz4 * gz + self.qbz5 * gz.abs())
            * self.lky
            / lmuy;
        let dt = fz * (self.qdz1 + self.qdz2 * dfz) * (1.0 + self.qdz3 * gz + self.qdz4 * gz * gz) * r / self.fnomin
            * self.ltr;
        let et = ((self.qez1 + self.qez2 * dfz + self.qez3 * dfz * dfz)
            * (1.0 + (self.qez4 + self.qez5 * gz) * std::f64::consts::FRAC_2_PI * (bt * self.qcz1 * at).atan()))
        .min(1.0);
        let trail = dt * hill(bt, self.qcz1, et, at) * alpha.cos();
        let shf = shy + svy / ky;
        let ar = equivalent(alpha + shf);
        let br = self.qbz9 * self.lky / lmuy + self.qbz10 * by * cy;
        let dr = fz * ((self.qdz6 + self.qdz7 * dfz) * self.lres + (self.qdz8 + self.qdz9 * dfz) * gz) * r * lmuy;
        let residual = dr * (br * ar).atan().cos() * alpha.cos();
        let s = (self.ssz1 + self.ssz2 * fy / self.fnomin + (self.ssz3 + self.ssz4 * dfz) * gamma) * r * self.ls;
        let mz = -trail * (fy - svyk) + residual + s * fx;
        let mx = r * fz * (self.qsx1 - self.qsx2 * gamma + self.qsx3 * fy / self.fnomin) * self.lmx;
        let v = c.vx / self.longvl;
        let rolling = self.qsy1 + self.qsy2 * fx / self.fnomin + self.qsy3 * v.abs() + self.qsy4 * v.powi(4);
        let my = -r * fz * rolling * self.lmy * (c.omega / 0.5).tanh();
        TireForces { force: Vec3::new(fx, fy, fz), moment: Vec3::new(mx, my, mz) }
    }
}
