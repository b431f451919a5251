//! The unit contract through the C functions: call order, wrong references, null pointers, NaN, panics, states.

#![allow(clippy::undocumented_unsafe_blocks)] // every block calls the interface under test with pointers made beside it

use std::ffi::{CString, c_char, c_void};
use std::ptr::{null, null_mut};
use terramech_fmi2::types::*;
use terramech_fmi2::*;

#[derive(Clone, Copy)]
struct Vars {
    force: RealVar,
    mass: RealVar,
    mode: StringVar,
    speed: RealVar,
    history: RealArrayVar,
    load: RealArrayVar,
    marks: IntegerArrayVar,
}

fn declare() -> (Table, Vars) {
    let mut t = Table::new();
    let force = t.input_real("force.x", 0.0, "N", "Force");
    let mass = t.parameter_real("mass", 2.0, "kg", "Mass");
    t.range(mass, Some(0.1), None);
    let mode = t.parameter_string("mode", "", "What to do wrong");
    let speed = t.output_real("velocity.x", "m/s", "Speed");
    let history = t.output_real_array("history", "m/s", "All speeds so far");
    let load = t.input_real_array("load", "N", "Forces at vertices");
    let marks = t.input_integer_array("marks", "Indices");
    t.depends_initially(speed, &[mass.vr()]);
    (t, Vars { force, mass, mode, speed, history, load, marks })
}

struct Mass {
    v: Vars,
    speed: f64,
}

impl Unit for Mass {
    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        v.lock([self.v.mass.vr()], "the mass has been assembled with it");
        Ok(())
    }
    fn step(&mut self, v: &mut Values, host: &Host, step: Step) -> Result<(), UnitError> {
        match v.string(self.v.mode) {
            "panic" => panic!("the spring broke at 100 %"),
            "nan" => self.speed = f64::NAN,
            "numerical" => return Err(UnitError::numerical("no convergence")),
            "discard" => {
                return Err(UnitError::Discard {
                    last_successful_time: step.time + 0.25 * step.size,
                    reason: "too fast".into(),
                });
            }
            "long" => host.progress("settling", 0.5)?,
            _ => {}
        }
        self.speed += (v[self.v.force] + v.reals(self.v.load).iter().sum::<f64>()) / v[self.v.mass] * step.size;
        v[self.v.speed] = self.speed;
        let speed = self.speed;
        v.reals_mut(self.v.history).push(speed);
        Ok(())
    }
    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.speed)
    }
    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        self.speed = state::from_bytes(bytes)?;
        Ok(())
    }
}

fn models() -> Vec<Model> {
    let (table, v) = declare();
    vec![Model::new("mass", "A mass", table, move || Box::new(Mass { v, speed: 0.0 }))]
}

/// The environment's log. C's variadic logger cannot be written in stable Rust; our units pass no variadic
/// arguments, so on the platforms we support a function of the fixed arguments is called alike.
unsafe extern "C" fn log(env: *mut c_void, _: *const c_char, _: i32, _: *const c_char, message: *const c_char) {
    let (log, message) = unsafe { (&mut *env.cast::<Vec<String>>(), std::ffi::CStr::from_ptr(message)) };
    log.push(message.to_str().unwrap().replace("%%", "%"));
}

type FixedLogger = unsafe extern "C" fn(*mut c_void, *const c_char, i32, *const c_char, *const c_char);

struct Fmu {
    c: Fmi2Component,
    #[allow(clippy::box_collection)] // its address is the callbacks' environment
    log: Box<Vec<String>>,
}

fn instantiate_with(guid: &str, kind: i32, name: &str) -> Fmu {
    let mut messages: Box<Vec<String>> = Box::default();
    let callbacks = Fmi2CallbackFunctions {
        logger: Some(unsafe { std::mem::transmute::<FixedLogger, Fmi2CallbackLogger>(log as FixedLogger) }),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: (&raw mut *messages).cast(),
    };
    let (name, guid) = (CString::new(name).unwrap(), CString::new(guid).unwrap());
    let c = unsafe { export::instantiate(models, name.as_ptr(), kind, guid.as_ptr(), null(), &callbacks, 0) };
    Fmu { c, log: messages }
}

impl Fmu {
    fn new() -> Self {
        let fmu = instantiate_with(&models()[0].guid(), FMI2_CO_SIMULATION, "one");
        assert!(!fmu.c.is_null(), "{:?}", fmu.log);
        fmu
    }
    fn initialised(mode: &str) -> Self {
        let mut fmu = Self::new();
        let text = CString::new(mode).unwrap();
        let p = text.as_ptr();
        unsafe {
            assert_eq!(export::set_string(fmu.c, &vars().mode.vr(), 1, &p), FMI2_OK);
            assert_eq!(export::setup_experiment(fmu.c, 0, 0.0, 0.0, 0, 0.0), FMI2_OK);
            assert_eq!(export::enter_initialization_mode(fmu.c), FMI2_OK);
            assert_eq!(export::exit_initialization_mode(fmu.c), FMI2_OK);
        }
        fmu.log.clear();
        fmu
    }
    fn set(&self, var: RealVar, x: f64) -> Fmi2Status {
        unsafe { export::set_real(self.c, &var.vr(), 1, &x) }
    }
    fn get(&self, var: RealVar) -> Result<f64, Fmi2Status> {
        let mut x = 0.0;
        match unsafe { export::get_real(self.c, &var.vr(), 1, &mut x) } {
            FMI2_OK => Ok(x),
            status => Err(status),
        }
    }
    fn step(&self, time: f64) -> Fmi2Status {
        unsafe { export::do_step(self.c, time, 0.5, 1) }
    }
    fn history(&self) -> Vec<f64> {
        let mut n = 0;
        assert_eq!(unsafe { export::get_array_size(self.c, vars().history.vr(), &mut n) }, FMI2_OK);
        let mut values = vec![0.0; n];
        assert_eq!(unsafe { export::get_real_array(self.c, vars().history.vr(), values.as_mut_ptr(), n) }, FMI2_OK);
        values
    }
    fn last(&self) -> &str {
        self.log.last().map_or("", String::as_str)
    }
}

impl Drop for Fmu {
    fn drop(&mut self) {
        unsafe { export::free_instance(self.c) };
    }
}

fn vars() -> Vars {
    declare().1
}

#[test]
fn instantiation_refuses_what_is_not_this_model() {
    let fmu = instantiate_with("{nonsense}", FMI2_CO_SIMULATION, "one");
    assert!(fmu.c.is_null() && fmu.last().contains("{nonsense}") && fmu.last().contains("mass"), "{:?}", fmu.log);
    let fmu = instantiate_with(&models()[0].guid(), FMI2_MODEL_EXCHANGE, "one");
    assert!(fmu.c.is_null() && fmu.last().contains("co-simulation"));
    let fmu = instantiate_with(&models()[0].guid(), FMI2_CO_SIMULATION, "");
    assert!(fmu.c.is_null() && fmu.last().contains("name"));
}

#[test]
fn calls_out_of_order_are_refused_with_the_state() {
    let fmu = Fmu::new();
    assert_eq!(fmu.step(0.0), FMI2_ERROR);
    assert!(fmu.last().contains("fmi2DoStep") && fmu.last().contains("before initialization mode"), "{}", fmu.last());
    assert_eq!(unsafe { export::enter_initialization_mode(fmu.c) }, FMI2_ERROR);
    assert!(fmu.last().contains("fmi2SetupExperiment"));
    assert_eq!(fmu.get(vars().speed), Err(FMI2_ERROR));
    let fmu = Fmu::initialised("");
    assert_eq!(unsafe { export::enter_initialization_mode(fmu.c) }, FMI2_ERROR);
    assert_eq!(fmu.set(vars().mass, 3.0), FMI2_ERROR);
    assert!(fmu.last().contains("mass") && fmu.last().contains("after initialization"), "{}", fmu.last());
    assert_eq!(fmu.step(0.0), FMI2_OK);
    assert_eq!(fmu.step(0.0), FMI2_ERROR);
    assert!(fmu.last().contains("0.5"), "{}", fmu.last());
    unsafe {
        assert_eq!(export::terminate(fmu.c), FMI2_OK);
        assert_eq!(export::do_step(fmu.c, 0.5, 0.5, 1), FMI2_ERROR);
        assert_eq!(export::reset(fmu.c), FMI2_OK);
        assert_eq!(export::setup_experiment(fmu.c, 0, 0.0, 0.0, 0, 0.0), FMI2_OK);
    }
}

#[test]
fn wrong_references_types_and_ranges_are_named() {
    let fmu = Fmu::new();
    let mut x = 0.0;
    let mut i = 0;
    unsafe {
        assert_eq!(export::get_real(fmu.c, &999, 1, &mut x), FMI2_ERROR);
        assert!(fmu.last().contains("999"), "{}", fmu.last());
        assert_eq!(export::get_integer(fmu.c, &vars().mass.vr(), 1, &mut i), FMI2_ERROR);
        assert!(fmu.last().contains("mass") && fmu.last().contains("Integer"), "{}", fmu.last());
    }
    assert_eq!(fmu.set(vars().mass, 0.0), FMI2_ERROR);
    assert!(fmu.last().contains("0.1"), "{}", fmu.last());
    assert_eq!(fmu.set(vars().speed, 0.0), FMI2_ERROR);
    assert!(fmu.last().contains("output"), "{}", fmu.last());
}

#[test]
fn null_pointers_are_refused() {
    let fmu = Fmu::new();
    unsafe {
        assert_eq!(export::do_step(null_mut(), 0.0, 1.0, 0), FMI2_ERROR);
        assert_eq!(export::get_real(fmu.c, null(), 1, null_mut()), FMI2_ERROR);
        assert!(fmu.last().contains("null"), "{}", fmu.last());
        assert_eq!(export::get_real(fmu.c, null(), 0, null_mut()), FMI2_OK);
        assert_eq!(export::set_string(fmu.c, &vars().mode.vr(), 1, &null()), FMI2_ERROR);
        assert_eq!(export::set_fmu_state(fmu.c, null_mut()), FMI2_ERROR);
        assert_eq!(export::set_real_array(fmu.c, vars().load.vr(), null(), 3), FMI2_ERROR);
        export::free_instance(null_mut());
    }
}

#[test]
fn values_that_are_not_finite_are_caught_where_they_enter_and_leave() {
    let fmu = Fmu::initialised("nan");
    assert_eq!(fmu.set(vars().force, f64::NAN), FMI2_ERROR);
    assert!(fmu.last().contains("force.x") && fmu.last().contains("NaN"), "{}", fmu.last());
    let load = [0.0, f64::INFINITY];
    assert_eq!(unsafe { export::set_real_array(fmu.c, vars().load.vr(), load.as_ptr(), 2) }, FMI2_ERROR);
    assert!(fmu.last().contains("load") && fmu.last().contains("element 1"), "{}", fmu.last());
    assert_eq!(fmu.step(0.0), FMI2_OK);
    assert_eq!(fmu.get(vars().speed), Err(FMI2_ERROR));
    assert!(fmu.last().contains("velocity.x"), "{}", fmu.last());
}

#[test]
fn a_panic_poisons_its_instance_alone() {
    let (bad, good) = (Fmu::initialised("panic"), Fmu::initialised(""));
    assert_eq!(bad.step(0.0), FMI2_ERROR);
    assert!(bad.last().contains("the spring broke at 100 %"), "{}", bad.last());
    assert_eq!(bad.step(0.0), FMI2_ERROR);
    assert!(bad.last().contains("poisoned"), "{}", bad.last());
    assert_eq!(good.set(vars().force, 4.0), FMI2_OK);
    assert_eq!(good.step(0.0), FMI2_OK);
    assert_eq!(good.get(vars().speed), Ok(1.0));
    assert_eq!(unsafe { export::reset(bad.c) }, FMI2_OK);
    assert_eq!(unsafe { export::setup_experiment(bad.c, 0, 0.0, 0.0, 0, 0.0) }, FMI2_OK);
}

#[test]
fn numerical_failure_poisons_and_discard_tells_how_far() {
    let fmu = Fmu::initialised("numerical");
    assert_eq!(fmu.step(0.0), FMI2_ERROR);
    assert!(fmu.last().contains("no convergence"));
    assert_eq!(fmu.step(0.0), FMI2_ERROR);
    let fmu = Fmu::initialised("discard");
    assert_eq!(fmu.step(0.0), FMI2_DISCARD);
    let mut t = 0.0;
    assert_eq!(unsafe { export::get_real_status(fmu.c, FMI2_LAST_SUCCESSFUL_TIME, &mut t) }, FMI2_OK);
    assert_eq!(t, 0.125);
}

#[test]
fn two_instances_do_not_share_anything() {
    let (a, b) = (Fmu::initialised(""), Fmu::initialised(""));
    assert_eq!(a.set(vars().force, 4.0), FMI2_OK);
    assert_eq!(b.set(vars().force, 8.0), FMI2_OK);
    assert_eq!((a.step(0.0), b.step(0.0)), (FMI2_OK, FMI2_OK));
    assert_eq!((a.get(vars().speed), b.get(vars().speed)), (Ok(1.0), Ok(2.0)));
}

#[test]
fn arrays_change_their_size_and_are_checked() {
    let fmu = Fmu::initialised("");
    let (load, marks) = ([2.0, 2.0], [1, 2, 3]);
    unsafe {
        assert_eq!(export::set_real_array(fmu.c, vars().load.vr(), load.as_ptr(), 2), FMI2_OK);
        assert_eq!(export::set_integer_array(fmu.c, vars().marks.vr(), marks.as_ptr(), 3), FMI2_OK);
        let mut n = 0;
        assert_eq!(export::get_array_size(fmu.c, vars().marks.vr(), &mut n), FMI2_OK);
        assert_eq!(n, 3);
        assert_eq!(export::set_real_array(fmu.c, vars().marks.vr(), load.as_ptr(), 2), FMI2_ERROR);
        assert_eq!(export::get_array_size(fmu.c, vars().mass.vr(), &mut n), FMI2_ERROR);
    }
    assert_eq!(fmu.step(0.0), FMI2_OK);
    assert_eq!(unsafe { export::set_real_array(fmu.c, vars().load.vr(), null(), 0) }, FMI2_OK);
    assert_eq!(fmu.step(0.5), FMI2_OK);
    assert_eq!(fmu.history(), [1.0, 1.0]);
    let mut x = [0.0; 3];
    assert_eq!(unsafe { export::get_real_array(fmu.c, vars().history.vr(), x.as_mut_ptr(), 3) }, FMI2_ERROR);
    assert!(fmu.last().contains("3") && fmu.last().contains("2"), "{}", fmu.last());
}

#[test]
fn a_restored_state_continues_bit_for_bit_also_in_a_fresh_instance() {
    let fmu = Fmu::initialised("");
    fmu.set(vars().force, 0.3);
    assert_eq!(fmu.step(0.0), FMI2_OK);
    let mut state = null_mut();
    let mut bytes;
    unsafe {
        assert_eq!(export::get_fmu_state(fmu.c, &mut state), FMI2_OK);
        let mut n = 0;
        assert_eq!(export::serialized_fmu_state_size(fmu.c, state, &mut n), FMI2_OK);
        bytes = vec![0u8; n];
        assert_eq!(export::serialize_fmu_state(fmu.c, state, bytes.as_mut_ptr().cast(), n), FMI2_OK);
    }
    assert_eq!(fmu.step(0.5), FMI2_OK);
    let expected = fmu.history();
    unsafe { assert_eq!(export::set_fmu_state(fmu.c, state), FMI2_OK) };
    assert_eq!(fmu.step(0.5), FMI2_OK);
    assert_eq!(fmu.history(), expected);

    let fresh = Fmu::new();
    let mut again = null_mut();
    unsafe {
        assert_eq!(export::deserialize_fmu_state(fresh.c, bytes.as_ptr().cast(), bytes.len(), &mut again), FMI2_OK);
        assert_eq!(export::set_fmu_state(fresh.c, again), FMI2_OK);
    }
    assert_eq!(fresh.step(0.5), FMI2_OK);
    assert_eq!(fresh.history(), expected);

    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    let mut bad = null_mut();
    unsafe {
        assert_eq!(export::deserialize_fmu_state(fresh.c, bytes.as_ptr().cast(), bytes.len(), &mut bad), FMI2_ERROR);
        assert!(bad.is_null() && fresh.last().contains("hash"), "{}", fresh.last());
        for s in [&mut state, &mut again] {
            assert_eq!(export::free_fmu_state(fresh.c, s), FMI2_OK);
            assert!(s.is_null());
        }
    }
}

#[test]
fn a_host_that_asks_to_stop_is_obeyed() {
    unsafe extern "C" fn stop(env: *mut c_void, _: *const c_char, fraction: f64) -> i32 {
        unsafe { *env.cast::<f64>() = fraction };
        1
    }
    let fmu = Fmu::initialised("long");
    let mut seen = 0.0f64;
    unsafe { assert_eq!(export::set_progress(fmu.c, Some(stop), (&raw mut seen).cast()), FMI2_OK) };
    assert_eq!(fmu.step(0.0), FMI2_ERROR);
    assert!(seen == 0.5 && fmu.last().contains("settling"), "{}", fmu.last());
    unsafe { assert_eq!(export::set_progress(fmu.c, None, null_mut()), FMI2_OK) };
    assert_eq!(fmu.step(0.0), FMI2_OK);
}
