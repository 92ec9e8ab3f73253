// 32-bit numbers of one element of the arena in 16 bits.
const ELEMENT = 2u;
