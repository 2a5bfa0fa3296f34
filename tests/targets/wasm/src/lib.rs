//! The scenes for Node: one export that draws them, one import that is told of differences.
#![no_std]

use core::panic::PanicInfo;

use halfplane_scene::scenes::Memory;
use halfplane_scene::{Mismatch, check};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}

#[link(wasm_import_module = "env")]
unsafe extern "C" {
    /// A scene has another hash than it should.
    fn differs(name: *const u8, len: usize, found: u64);
}

static mut MEMORY: Memory = Memory::new();

/// Calls `tell(number)` for each scene that differs from the list, and returns how many scenes there are.
///
/// # Safety
/// Not to be called from two threads at once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn check_scenes() -> usize {
    // SAFETY: the only reference, as the caller promises.
    let memory = unsafe { &mut *(&raw mut MEMORY) };
    check(memory, |Mismatch { name, found, .. }| {
        // SAFETY: `run.mjs` reads the name and nothing else.
        unsafe { differs(name.as_ptr(), name.len(), found) };
    })
}
