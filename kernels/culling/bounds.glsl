// Whether a sphere is one: else nobody can say that it is not seen.
bool isUsable(float x) { return isFinite(x) && abs(x) <= kMostWorld; }

bool isUsable(Bounds b) {
  return isUsable(b.centre.x) && isUsable(b.centre.y) && isUsable(b.centre.z) &&
         isUsable(b.radius) && b.radius >= 0.0;
}
