//! What an expression or statement of a shader does: operations, and what it asks of each binding.

use naga::front::Typifier;
use naga::{
    AddressSpace, Arena, BinaryOperator, Expression, Handle, MathFunction, Module, Statement, TypeInner, UnaryOperator,
};

/// Numbers that `counted.wgsl` keeps of a thread, and the first that belongs to a binding.
pub const NUMBERS: usize = 27;
pub const FIRST: usize = 3;

/// Amounts by number.
pub type Sum = [u32; NUMBERS];

/// What expressions and statements do.
pub struct Reader<'a> {
    pub module: &'a Module,
    pub expressions: &'a Arena<Expression>,
    pub types: &'a Typifier,
    /// Groups and bindings, in the order of their numbers.
    pub bindings: &'a [(u32, u32)],
}

impl Reader<'_> {
    pub fn statement(&self, statement: &Statement, sum: &mut Sum) {
        match *statement {
            Statement::Emit(ref range) => range.clone().for_each(|e| self.expression(e, sum)),
            Statement::Store { pointer, .. } => self.memory(pointer, sum),
            Statement::Atomic { pointer, .. } => {
                sum[0] += 1;
                // Read and written.
                self.memory(pointer, sum);
                self.memory(pointer, sum);
            }
            Statement::ImageStore { image, .. } => self.texels(image, 1, sum),
            _ => {}
        }
    }

    fn expression(&self, handle: Handle<Expression>, sum: &mut Sum) {
        let size = |e| components(self.inner(e));
        sum[0] += match self.expressions[handle] {
            Expression::Load { pointer } => {
                self.memory(pointer, sum);
                0
            }
            Expression::ImageLoad { image, .. } => {
                self.texels(image, 1, sum);
                0
            }
            // Neighbours that a filter takes, too, are others' own.
            Expression::ImageSample { image, gather, .. } => {
                self.texels(image, if gather.is_some() { 4 } else { 1 }, sum);
                0
            }
            Expression::Unary { op, expr } => {
                if op == UnaryOperator::Negate {
                    0
                } else {
                    size(expr)
                }
            }
            Expression::Binary { op, left, right } => match (op, self.inner(left), self.inner(right)) {
                (BinaryOperator::Divide | BinaryOperator::Modulo, ..) => 4 * size(handle),
                // Products of matrices: as many multiply-adds as rows times columns of the sum.
                (BinaryOperator::Multiply, &TypeInner::Matrix { columns, .. }, other)
                    if !matches!(other, TypeInner::Scalar(_)) =>
                {
                    2 * columns as u32 * size(handle)
                }
                (BinaryOperator::Multiply, TypeInner::Vector { size: of, .. }, TypeInner::Matrix { .. }) => {
                    2 * *of as u32 * size(handle)
                }
                _ => size(left).max(size(right)),
            },
            Expression::Select { .. } | Expression::Derivative { .. } => size(handle),
            Expression::Relational { argument, .. } => size(argument),
            Expression::As { convert: Some(_), .. } => size(handle),
            Expression::Math { fun, arg, .. } => math(fun, size(arg), size(handle)),
            _ => 0,
        };
    }

    /// Bytes of what a pointer points to, where that lies in a bound buffer.
    fn memory(&self, pointer: Handle<Expression>, sum: &mut Sum) {
        let Some(number) = self.number(pointer, |space| matches!(space, AddressSpace::Storage { .. })) else { return };
        let bytes = match *self.inner(pointer) {
            TypeInner::Pointer { base, .. } => self.module.types[base].inner.try_size(self.module.to_ctx()),
            TypeInner::ValuePointer { size, scalar, .. } => {
                Some(size.map_or(1, |s| s as u32) * u32::from(scalar.width))
            }
            _ => None,
        };
        sum[number] += bytes.unwrap_or(0);
    }

    fn texels(&self, image: Handle<Expression>, n: u32, sum: &mut Sum) {
        if let Some(number) = self.number(image, |space| space == AddressSpace::Handle) {
            sum[number] += n;
        }
    }

    /// The number of the binding that a pointer or texture comes from.
    fn number(&self, mut at: Handle<Expression>, counts: impl Fn(AddressSpace) -> bool) -> Option<usize> {
        loop {
            match self.expressions[at] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => at = base,
                Expression::GlobalVariable(variable) => {
                    let variable = &self.module.global_variables[variable];
                    let binding = variable.binding.as_ref().filter(|_| counts(variable.space))?;
                    let at = self.bindings.iter().position(|b| *b == (binding.group, binding.binding))?;
                    return Some(FIRST + at);
                }
                _ => return None,
            }
        }
    }

    /// Whether a pointer or texture is a bound one's, which a read of takes long.
    pub fn far(&self, at: Handle<Expression>) -> bool {
        self.number(at, |space| matches!(space, AddressSpace::Storage { .. } | AddressSpace::Handle)).is_some()
    }

    fn inner(&self, e: Handle<Expression>) -> &TypeInner {
        self.types.get(e, &self.module.types)
    }
}

fn components(inner: &TypeInner) -> u32 {
    match *inner {
        TypeInner::Vector { size, .. } => size as u32,
        TypeInner::Matrix { columns, rows, .. } => columns as u32 * rows as u32,
        _ => 1,
    }
}

/// Operations of a function of `n` components that makes `made`.
fn math(fun: MathFunction, n: u32, made: u32) -> u32 {
    use MathFunction as M;
    match fun {
        // A modifier of what reads it.
        M::Abs | M::Saturate => 0,
        M::Fma | M::Clamp => 2 * n,
        M::Mix => 3 * n,
        M::Dot => 2 * n - 1,
        M::Cross => 9,
        M::Length => 2 * n + 3,
        M::Distance => 3 * n + 3,
        M::Normalize => 3 * n + 3,
        M::Reflect => 4 * n,
        M::FaceForward => 3 * n,
        M::SmoothStep => 10 * n,
        M::Pow | M::Atan2 => 8 * n,
        M::Cos
        | M::Sin
        | M::Tan
        | M::Cosh
        | M::Sinh
        | M::Tanh
        | M::Acos
        | M::Asin
        | M::Atan
        | M::Asinh
        | M::Acosh
        | M::Atanh
        | M::Exp
        | M::Exp2
        | M::Log
        | M::Log2
        | M::Sqrt
        | M::InverseSqrt => 4 * n,
        M::Outer | M::Determinant | M::Inverse | M::Transpose => made,
        _ => n.max(made),
    }
}
