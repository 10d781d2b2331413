//! The program `ndf`; see the library of this crate.

fn main() -> std::process::ExitCode {
    std::process::ExitCode::SUCCESS
}
