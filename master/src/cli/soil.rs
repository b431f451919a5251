//! `terramech soil`: virtual tests of a specification's soil.

use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};

use super::args::Soil;
use super::commands::told;
use crate::check::{self, Options};
use crate::loading::{Environment, LogLine};
use crate::run::{self, Display, ExitCode, Stop};

/// Shows progress, keeps what the unit tells.
struct Bench {
    display: Mutex<Display>,
    stop: Stop,
    lines: Mutex<Vec<String>>,
}

impl Environment for Bench {
    fn log(&self, line: LogLine<'_>) {
        if line.is_warning() {
            eprintln!("{}: warning: {}", line.unit, line.text);
        } else if !line.is_error() && line.category == "logInfo" {
            self.lines.lock().unwrap_or_else(PoisonError::into_inner).push(line.text.to_owned());
        }
    }

    fn progress(&self, unit: &str, phase: &str, fraction: f64) -> bool {
        self.display.lock().unwrap_or_else(PoisonError::into_inner).phase(unit, phase, fraction);
        !self.stop.is_asked()
    }
}

/// Carries out the command.
pub fn soil(args: &Soil) -> ExitCode {
    // From the working folder, else along --fmu-path, as the FMUs of a description.
    let along = args.fmu_path.iter().map(|folder| folder.join(&args.fmu)).find(|p| p.exists());
    let fmu = if args.fmu.exists() { args.fmu.clone() } else { along.unwrap_or_else(|| args.fmu.clone()) };
    let specification = std::path::absolute(&args.specification).unwrap_or_else(|_| args.specification.clone());
    if !specification.is_file() {
        eprintln!("{}: there is no such file; allowed: a terrain's specification (JSON)", args.specification.display());
        return ExitCode::Input;
    }
    let name = fmu.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let set = vec![format!("{name}.specification={}", specification.display())];
    let plan = match check::plan_of_fmu(&fmu, &Options { set, ..Options::default() }) {
        Ok(plan) => plan,
        Err(faults) => {
            let (text, code) = told(&faults);
            eprintln!("{text}");
            return code;
        }
    };
    let stop = Stop::new();
    if let Err(e) = stop.on_interrupt(true) {
        eprintln!("note: Ctrl-C will not stop this cleanly: {e}");
    }
    let threads = args.threads.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
    let display = if args.quiet { Display::quiet() } else { Display::for_stderr() };
    let bench = Arc::new(Bench { display: Mutex::new(display), stop, lines: Mutex::default() });
    let environment: Arc<dyn Environment> = Arc::clone(&bench) as Arc<dyn Environment>;
    let measured = crate::coupling::measure(&plan, threads, &environment, &args.out);
    bench.display.lock().unwrap_or_else(PoisonError::into_inner).finish();
    if let Err(failure) = measured {
        if bench.stop.is_asked() {
            eprintln!("stopped on request; nothing was written");
            return ExitCode::Stopped;
        }
        eprintln!("{failure}");
        return run::code_of_failure(&failure);
    }
    let lines = bench.lines.lock().unwrap_or_else(PoisonError::into_inner);
    // A reader that has gone (`| head`) is no mistake.
    let _ = write!(std::io::stdout().lock(), "{}\nwritten to {}\n", lines.join("\n"), args.out.display());
    ExitCode::Done
}
