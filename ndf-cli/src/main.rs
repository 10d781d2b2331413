//! The program `ndf`; see the library of this crate.

fn main() -> std::process::ExitCode {
    ndf_cli::run(std::env::args_os()).into()
}
