//! PNG and multi-layer EXR, written whole or not at all.
