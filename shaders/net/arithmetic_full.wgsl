// Products in 32 bits.
alias Four = vec4f;
alias Matrix = mat4x4f;

fn narrow(v: vec4f) -> Four { return v; }
fn wide(v: Four) -> vec4f { return v; }
