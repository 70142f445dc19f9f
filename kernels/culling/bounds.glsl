// Whether a sphere is one: else nobody can say that it is not seen. By its bits, whose order is
// that of the numbers from 0 up, and which put infinity, NaN and what is negative behind them all.
bool isUpToMost(uint bits) { return bits <= floatBitsToUint(kMostWorld); }

bool isUsable(Bounds b) {
  const uvec3 centre = floatBitsToUint(b.centre) & 0x7fffffffu;  // of either sign
  return isUpToMost(centre.x) && isUpToMost(centre.y) && isUpToMost(centre.z) &&
         isUpToMost(floatBitsToUint(b.radius));
}
