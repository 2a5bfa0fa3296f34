//! Draws every scene and compares its hash with the list. Exits with 0 when all are equal.
#![no_std]
#![no_main]

use halfplane_firmware::board;
use halfplane_scene::check;
use halfplane_scene::scenes::Memory;
use semihosting::{println, process};

static mut MEMORY: Memory = Memory::new();

#[board::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let memory = unsafe { &mut *(&raw mut MEMORY) };
    let mut differing = 0;
    let scenes = check(memory, |mismatch| {
        differing += 1;
        println!("{} is {:016x}, not {:x?}", mismatch.name, mismatch.found, mismatch.expected);
    });
    println!("hashes {} of {scenes}", scenes - differing);
    process::exit(i32::from(differing != 0))
}
