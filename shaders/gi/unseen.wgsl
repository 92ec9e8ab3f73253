//#import gi/inputs.wgsl

// What stands in for light from where the screen does not show: the sky, and what the picture's
// surfaces send on. Expects `exposure` in the module, and SKY and BOUNCE from the prelude
// (gi::ambient documents them).

fn unseen_light() -> vec3f {
    return SKY * params.environment.rgb + BOUNCE * vec3f(exposure.red, exposure.green, exposure.blue);
}
