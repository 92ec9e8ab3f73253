//! Functions of one value, as the weights file spells them.

/// Function applied to each value. In the file a word (`"relu"`), or an object for the one with a
/// number (`{"leaky_relu": 0.2}`).
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// x
    #[default]
    None,
    /// max(x, 0)
    Relu,
    /// x where x > 0, else slope · x.
    LeakyRelu(f32),
    /// tanh x
    Tanh,
    /// 1 / (1 + e⁻ˣ)
    Sigmoid,
    /// x / (1 + e⁻ˣ)
    Silu,
    /// ln(1 + eˣ)
    Softplus,
    /// eˣ
    Exp,
}

impl Activation {
    /// The function itself.
    pub fn apply(self, x: f32) -> f32 {
        match self {
            Activation::None => x,
            Activation::Relu => x.max(0.0),
            Activation::LeakyRelu(slope) => {
                if x > 0.0 {
                    x
                } else {
                    slope * x
                }
            }
            Activation::Tanh => x.tanh(),
            Activation::Sigmoid => 1.0 / (1.0 + (-x).exp()),
            Activation::Silu => x / (1.0 + (-x).exp()),
            // Written so that neither large x overflows nor large −x loses everything.
            Activation::Softplus => x.max(0.0) + (-x.abs()).exp().ln_1p(),
            Activation::Exp => x.exp(),
        }
    }

    /// Number by which the kernels know it; `ACTIVATION` in `shaders/net/epilogue.wgsl`.
    pub fn code(self) -> u32 {
        match self {
            Activation::None | Activation::Relu | Activation::LeakyRelu(_) => 2,
            Activation::Tanh => 3,
            Activation::Sigmoid => 4,
            Activation::Silu => 5,
            Activation::Softplus => 6,
            Activation::Exp => 7,
        }
    }

    /// What those of code 2 multiply negative values with.
    pub fn slope(self) -> f32 {
        match self {
            Activation::None => 1.0,
            Activation::LeakyRelu(slope) => slope,
            _ => 0.0,
        }
    }

    /// As the file spells it.
    pub fn name(self) -> &'static str {
        match self {
            Activation::None => "none",
            Activation::Relu => "relu",
            Activation::LeakyRelu(_) => "leaky_relu",
            Activation::Tanh => "tanh",
            Activation::Sigmoid => "sigmoid",
            Activation::Silu => "silu",
            Activation::Softplus => "softplus",
            Activation::Exp => "exp",
        }
    }
}
