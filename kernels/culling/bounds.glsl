// Whether a sphere is one: else nobody can say that it is not seen. By its bits, whose order is
// that of the numbers from 0 up, and which put infinity and NaN behind them all.
bool isUsable(float x) { return (floatBitsToUint(x) & 0x7fffffffu) <= floatBitsToUint(kMostWorld); }

bool isUsable(Bounds b) {
  return isUsable(b.centre.x) && isUsable(b.centre.y) && isUsable(b.centre.z) &&
         isUsable(b.radius) && b.radius >= 0.0;
}
