//! Tells the linker which memory the board has.

use std::env;
use std::path::Path;

fn main() {
    let variable = |name| env::var(name).expect("set by cargo");
    let arch = variable("CARGO_CFG_TARGET_ARCH");
    let memory = Path::new(&variable("CARGO_MANIFEST_DIR")).join("memory").join(&arch);
    println!("cargo:rustc-link-search={}", memory.display());
    println!("cargo:rerun-if-changed={}", memory.join("memory.x").display());
    let arguments: &[&str] = match arch.as_str() {
        "arm" => &["-Tlink.x", "-nmagic"],
        "riscv32" => &["-Tmemory.x", "-Tlink.x"],
        _ => &[],
    };
    for argument in arguments {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
