//#import gi/inputs.wgsl

// Light from what the screen does not show: the sky, and what the picture's surfaces send on.
// Expects `exposure` in the module, and SKY and BOUNCE from the prelude (gi::ambient documents
// them).

fn ambient_term() -> vec3f {
    return SKY * params.environment.rgb + BOUNCE * vec3f(exposure.red, exposure.green, exposure.blue);
}
