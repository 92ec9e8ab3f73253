// Numbers of one element of the arena in 32 bits.
const ELEMENT = 4u;
