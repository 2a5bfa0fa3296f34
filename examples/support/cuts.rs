//! One frame, drawn by some numbers of threads and cut into tiles of some sizes: always the same picture.

use super::scene;
use std::time::Instant;

/// What `draw` makes of a number of threads and a size of tiles, for a picture of this size. Says how long each takes.
///
/// # Errors
///
/// When `draw` has one.
///
/// # Panics
///
/// When two pictures differ.
pub fn compare<E>(
    size: (u32, u32),
    draw: impl Fn(usize, (u32, u32)) -> Result<Vec<u32>, E>,
) -> Result<Vec<u32>, E> {
    let first = draw(1, size)?;
    for threads in [1, 2, 3, 7, 16] {
        for tile in [(8, 8), (64, 32), (127, 61), (256, 256), (size.0, 16), size] {
            let start = Instant::now();
            let pixels = draw(threads, tile)?;
            let (time, hash) = (start.elapsed().as_secs_f64() * 1e3, scene::hash(&pixels));
            println!(
                "{threads:2} threads, tiles of {:4} × {:3}: {time:6.1} ms, hash {hash:016x}",
                tile.0, tile.1
            );
            assert!(pixels == first, "the picture does not depend on how the frame is cut");
        }
    }
    Ok(first)
}
