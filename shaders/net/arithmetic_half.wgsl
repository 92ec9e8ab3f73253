// Products of a matrix and a vector, four numbers each, in 16 bits (an optional feature); their
// sums stay in 32.
alias Four = vec4<f16>;
alias Matrix = mat4x4<f16>;

fn narrow(v: vec4f) -> Four { return Four(v); }
fn wide(v: Four) -> vec4f { return vec4f(v); }
