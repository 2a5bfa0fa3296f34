//! Gives the linker cortex-m-rt's script, and the script our memory.x.

use std::env;

fn main() {
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none") {
        println!("cargo:rustc-link-search={}", env::var("CARGO_MANIFEST_DIR").expect("set by cargo"));
        println!("cargo:rustc-link-arg-bin=firmware=-Tlink.x");
        println!("cargo:rustc-link-arg-bin=firmware=-nmagic");
    }
    println!("cargo:rerun-if-changed=memory.x");
}
