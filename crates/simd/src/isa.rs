//! Which instruction set the kernels use: chosen at run time, pinned by `TERRAMECH_ISA`.

use std::fmt;
use std::str::FromStr;

/// An instruction path. Each gives the same bits on every machine that has it; two paths differ by round-off, since
/// wider ones contract products and sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Isa {
    /// Plain Rust: the reference, and the path of stored hashes.
    Portable,
    /// AVX2 with FMA, four reals at a time.
    Avx2,
    /// AVX-512 F, eight reals at a time.
    Avx512,
}

/// Name of the environment variable that pins the path.
pub const VARIABLE: &str = "TERRAMECH_ISA";

impl Isa {
    /// Every path, slowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Its name: `portable`, `avx2` or `avx512`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Whether this processor can run it.
    pub fn runs_here(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => Self::Avx2.runs_here() && is_x86_feature_detected!("avx512f"),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The widest path that this processor has.
    pub fn widest() -> Self {
        Self::ALL.into_iter().rev().find(|isa| isa.runs_here()).unwrap_or(Self::Portable)
    }

    /// What `TERRAMECH_ISA` asks for, or the widest path when it is unset or empty.
    ///
    /// # Errors
    /// An unknown name, or a path that this processor lacks: a message with what is allowed.
    pub fn chosen() -> Result<Self, String> {
        match std::env::var(VARIABLE) {
            Ok(name) if !name.is_empty() => name.parse(),
            _ => Ok(Self::widest()),
        }
    }
}

impl fmt::Display for Isa {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Isa {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|isa| isa.name().eq_ignore_ascii_case(name));
        known.filter(|isa| isa.runs_here()).ok_or_else(|| {
            let here: Vec<_> = Self::ALL.into_iter().filter(|isa| isa.runs_here()).map(Self::name).collect();
            let why = if known.is_some() { "this processor lacks it" } else { "no such instruction path" };
            format!("{VARIABLE} is '{name}': {why}; here: {}", here.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_others_are_refused_with_what_is_allowed() {
        for isa in Isa::ALL.into_iter().filter(|isa| isa.runs_here()) {
            assert_eq!(isa.name().parse(), Ok(isa));
        }
        let message = "sse9".parse::<Isa>().unwrap_err();
        assert!(message.contains("sse9") && message.contains("portable"), "{message}");
    }

    #[test]
    fn the_widest_path_runs_here() {
        assert!(Isa::widest().runs_here());
    }
}
