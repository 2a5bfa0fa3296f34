//! Measures flash: built with `EXTRA=NAME` in the environment, it holds that draw of `extras.rs`. Never run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use halfplane_firmware::board;
use halfplane_firmware::extras::{Memory, Mesh, find};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}

static mut MEMORY: Memory = Memory::new();

#[board::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let memory = black_box(unsafe { &mut *(&raw mut MEMORY) });
    memory.clear();
    let mesh: Mesh<'_> = black_box((&[], &[], &[]));
    if option_env!("EXTRA").is_some() {
        const NAME: &str = match option_env!("EXTRA") {
            Some(name) => name,
            None => "draw",
        };
        black_box(const { find(NAME) }(memory, mesh));
    }
    black_box((memory, mesh));
    loop {}
}
