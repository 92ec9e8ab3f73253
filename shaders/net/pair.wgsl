// Two matrices of weights that follow each other.
struct Pair { first: mat4x4f, second: mat4x4f }

fn pair(at: u32) -> Pair { return Pair(weight(at), weight(at + 1u)); }
