//! A hash map for the many small keys of meshes (corners, edges). With the standard one, joining
//! triangles by their edges took half of the time in which trees were built. Its seed is one that no
//! file can know, so that none can be made whose keys all collide.

use foldhash::{HashMapExt, fast::RandomState};
use std::collections::HashMap;

/// A map whose keys are a few words.
pub(crate) type Map<K, V> = HashMap<K, V, RandomState>;

/// An empty map with room for `count`.
pub(crate) fn map<K, V>(count: usize) -> Map<K, V> {
    Map::with_capacity(count)
}
