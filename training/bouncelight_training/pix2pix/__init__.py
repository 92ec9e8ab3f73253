"""The paper's own recipe: a Pix2Pix generator that makes the ray-traced picture out of four pictures (Harris-Dewey and Klein 2021)."""
