//! Scenes whose every bit is known, to compare targets by.
//!
//! [`scenes`] draws them and hashes colours, depths, weights and statistics; [`expected`] is the one list of what must
//! come out. `tests/scene.rs` checks it wherever `cargo test` runs, `tests/targets/run` on every other target.
#![no_std]

pub mod expected;
pub mod scenes;

/// Why [`check`] is not content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// The scene.
    pub name: &'static str,
    /// Its hash here.
    pub found: u64,
    /// Its hash in the list, if it is there.
    pub expected: Option<u64>,
}

/// Draws every scene, and tells each that differs from the list. Returns how many there are.
pub fn check(memory: &mut scenes::Memory, mut tell: impl FnMut(Mismatch)) -> usize {
    for scene in &scenes::SCENES {
        let found = scene.hash(memory);
        let expected = expected::HASHES.iter().find(|(name, _)| *name == scene.name).map(|(_, hash)| *hash);
        if expected != Some(found) {
            tell(Mismatch { name: scene.name, found, expected });
        }
    }
    scenes::SCENES.len()
}
