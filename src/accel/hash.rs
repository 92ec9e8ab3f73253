//! A hash map for the many small keys of meshes (corners, edges). With the standard one, joining
//! triangles by their edges took half of the time in which trees were built.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hasher, RandomState};

/// A map whose keys are a few words.
pub(crate) type Map<K, V> = HashMap<K, V, Seeded>;

/// An empty map with room for `count`.
pub(crate) fn map<K, V>(count: usize) -> Map<K, V> {
    HashMap::with_capacity_and_hasher(count, Seeded(RandomState::new().hash_one(0u8)))
}

/// Begins every hash with a number that no file can know, so that none can be made whose keys all
/// collide.
#[derive(Clone)]
pub(crate) struct Seeded(u64);

impl BuildHasher for Seeded {
    type Hasher = Folded;

    fn build_hasher(&self) -> Folded {
        Folded(self.0)
    }
}

/// Multiplies to 128 bits and folds both halves together (as wyhash does), word by word.
pub(crate) struct Folded(u64);

impl Folded {
    fn mix(&mut self, word: u64) {
        let product = u128::from(self.0 ^ word) * 0x9e37_79b9_7f4a_7c15;
        self.0 = (product >> 64) as u64 ^ product as u64;
    }
}

impl Hasher for Folded {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.mix(u64::from_le_bytes(word));
        }
    }

    fn write_u32(&mut self, word: u32) {
        self.mix(word.into());
    }

    fn write_usize(&mut self, word: usize) {
        self.mix(word as u64);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
