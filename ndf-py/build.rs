//! Folds functions whose code is the same, of which generics leave many: a fortieth of the wheel, whose size `cargo xtask python` prints.
//!
//! Rust's own linker does so, which is the usual one on this target alone.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is = |variable: &str, value: &str| std::env::var(variable).is_ok_and(|found| found == value);
    if is("CARGO_CFG_TARGET_ARCH", "x86_64")
        && is("CARGO_CFG_TARGET_OS", "linux")
        && is("CARGO_CFG_TARGET_ENV", "gnu")
    {
        println!("cargo::rustc-cdylib-link-arg=-Wl,--icf=all");
    }
}
