//! Measures each draw of `extras.rs`: instructions of a large triangle, stack of a clipped one; and triangles beside a tile.
#![no_std]
#![no_main]

use core::hint::black_box;

use halfplane::glam::{Vec3, Vec4};
use halfplane_firmware::board;
use halfplane_firmware::extras::{ALL, Beside, Memory, beside};
use semihosting::{println, process};

static mut MEMORY: Memory = Memory::new();

#[board::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let memory = unsafe { &mut *(&raw mut MEMORY) };
    process::exit(i32::from(measure(memory).is_none()))
}

fn measure(memory: &mut Memory) -> Option<()> {
    let colors = [Vec3::X, Vec3::Y, Vec3::Z];
    // Through the near plane; and half of the frame.
    let clipped =
        [Vec4::new(-1.0, -1.0, -0.5, 0.5), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 2.0, 1.5, 2.0)];
    let large =
        [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(2.0, -2.0, 1.0, 2.0), Vec4::new(-3.0, 3.0, 1.0, 3.0)];
    for (name, draw) in ALL {
        memory.clear();
        let (bytes, drawn) = board::stack(|| draw(memory, black_box((&clipped, &colors, &[0, 1, 2]))));
        println!("{name}/stack {bytes}");
        (drawn?.clipped == 1).then_some(())?;
        memory.clear();
        let (instructions, drawn) =
            board::instructions(|| draw(memory, black_box((&large, &colors, &[0, 1, 2]))));
        let pixels = drawn?.samples_passed;
        (pixels > 4000).then_some(())?;
        println!("{name}/instructions {instructions}");
        println!("{name}/pixels {pixels}");
    }

    // Small triangles at the top left, drawn into the tile at the bottom right: the cost of each beyond the first eight.
    let small =
        [Vec4::new(-0.9, 0.9, 0.5, 1.0), Vec4::new(-0.9, 0.8, 0.5, 1.0), Vec4::new(-0.8, 0.8, 0.5, 1.0)];
    let indices: [u16; 48] = core::array::from_fn(|i| (i % 3) as u16);
    for what in [Beside::Positions, Beside::Projected, Beside::Records] {
        let [few, many] = [8, 16].map(|count| {
            let mesh = black_box((&small[..], &colors[..], &indices[..3 * count]));
            beside(memory, mesh, what, |draw| board::instructions(draw).0)
        });
        println!("beside_{what:?}/instructions {}", many?.checked_sub(few?)? / 8);
    }
    Some(())
}
