//! Every bit of a set of scenes, against a list that holds for all targets.
//!
//! The scenes live in a crate of their own, `tests/targets/scene`, because microcontrollers draw them too. Here is the
//! part of the proof that needs no more than `cargo test`; `tests/targets/run` does the rest.
//!
//! When a change of the arithmetic is wanted: `HALFPLANE_BLESS=1 cargo test --test scene` writes the list anew.

#[path = "targets/scene/src/expected.rs"]
pub mod expected;
#[path = "targets/scene/src/scenes.rs"]
pub mod scenes;

use expected::HASHES;
use scenes::{Memory, SCENES};

const LIST: &str = "tests/targets/scene/src/expected.rs";

/// Name and hash of every scene, here.
fn hashes() -> Vec<(&'static str, u64)> {
    let mut memory = Box::new(Memory::new());
    SCENES.iter().map(|scene| (scene.name, scene.hash(&mut memory))).collect()
}

fn list(hashes: &[(&str, u64)]) -> String {
    let mut list = String::new();
    for (name, hash) in hashes {
        let digits: Vec<String> = (0..4).map(|i| format!("{:04x}", hash >> (48 - 16 * i) & 0xffff)).collect();
        list += &format!("    (\"{name}\", 0x{}),\n", digits.join("_"));
    }
    list
}

#[test]
fn every_scene_has_the_hash_that_it_has_everywhere() {
    let hashes = hashes();
    assert!(hashes.iter().all(|(_, hash)| *hash != 0), "a scene could not be drawn: {hashes:x?}");
    if std::env::var_os("HALFPLANE_BLESS").is_some() {
        // From the crate of the scenes the list is nearer.
        let path = if std::path::Path::new(LIST).exists() { LIST } else { "src/expected.rs" };
        let old = std::fs::read_to_string(path).expect("the list");
        let (head, _) = old.split_once("= &[").expect("a slice");
        std::fs::write(path, format!("{head}= &[\n{}];\n", list(&hashes))).expect("the list");
        return;
    }
    let differing: Vec<_> = hashes.iter().filter(|found| !HASHES.contains(found)).copied().collect();
    assert!(differing.is_empty(), "these differ from {LIST}:\n{}", list(&differing));
    assert_eq!(hashes.len(), HASHES.len(), "the list names scenes that are not there");
}

#[test]
fn the_picture_does_not_depend_on_how_the_frame_is_cut() {
    let hashes = hashes();
    let hash = |name: &str| hashes.iter().find(|scene| scene.0 == name).map(|scene| scene.1);
    let whole = hash("cut/whole");
    assert!(whole.is_some(), "it is in the list");
    assert_eq!((hash("cut/tiles"), hash("cut/bands")), (whole, whole), "tiles and bands");
}

#[test]
fn a_scene_does_not_depend_on_what_was_drawn_before() {
    let mut forwards = hashes();
    let mut memory = Box::new(Memory::new());
    forwards.reverse();
    for (scene, (name, hash)) in SCENES.iter().rev().zip(forwards) {
        assert_eq!((scene.name, scene.hash(&mut memory)), (name, hash), "the other way round");
    }
}
