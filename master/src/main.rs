//! The command `terramech`.

fn main() -> std::process::ExitCode {
    std::process::ExitCode::from(terramech::cli::main(std::env::args_os()) as u8)
}
