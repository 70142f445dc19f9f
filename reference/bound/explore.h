// Control flow in a model: plain `if`, `while` and `?:` on comparisons of bounds.
//
//   Result r = explore([&] { return shade<Bounded>(inputs); });
//
// runs the model once for every combination of outcomes of the decisions that are undecided on the
// way (depth first, at most kMaxPaths runs) and joins the results. The first run decides as plain
// double does, and its `value`s are kept. What differs between runs is ambiguous. Beyond kMaxPaths
// every scalar is everything, ambiguous and not judged.
//
// What a model returns is joined scalar by scalar: Bounded, IntRange, the vectors and matrices,
// std::array and std::vector of such, and any struct that lists its members:
//
//   auto scalars() { return std::tie(colour, depth); }
//
// Members that are no bounds (bool, integers, double, enumerations) must agree in all runs; if
// they do not, std::logic_error is thrown: the model has to say there what may differ.
//
// The model may run many times, so it must not have side effects. Explorations nest.
#ifndef GNOMON_REFERENCE_BOUND_EXPLORE_H
#define GNOMON_REFERENCE_BOUND_EXPLORE_H

#include <array>
#include <cstddef>
#include <type_traits>
#include <tuple>
#include <utility>
#include <vector>

#include "reference/bound/bounded.h"
#include "reference/bound/integer.h"

namespace gnomon {

inline constexpr int kMaxPaths = 64;

namespace detail {

// The undecided decisions of one exploration, in the order in which the model meets them.
class Trail {
 public:
  Trail() noexcept = default;
  ~Trail();  // what was recorded on its paths is joined
  Trail(const Trail&) = delete;
  Trail& operator=(const Trail&) = delete;
  bool decide(const Decision& decision) noexcept;
  // On to the next combination; false after the last, and when there are too many.
  bool advance() noexcept;
  bool overflowed() const noexcept { return overflowed_; }
  // Of the values that undecided decisions were made on: the results depend on them.
  Flags flags() const noexcept { return flags_; }

 private:
  struct Step {
    bool taken;
    bool other;  // whether the other outcome has been, or is now, on its way
  };
  // A path with this many decisions has more siblings than are run.
  std::array<Step, kMaxPaths> steps_{};
  std::size_t depth_ = 0;  // decisions on record
  std::size_t at_ = 0;     // decisions met in this run
  int runs_ = 1;
  bool overflowed_ = false;
  Flags flags_ = 0;
};

// Makes a trail the thread's while the model runs; restores the outer one however it ends.
class FollowTrail {
 public:
  explicit FollowTrail(Trail& trail) noexcept;
  ~FollowTrail();
  FollowTrail(const FollowTrail&) = delete;
  FollowTrail& operator=(const FollowTrail&) = delete;

 private:
  Trail* trail_;
  Trail* outer_;
};

[[noreturn]] void throwPlainDiffers();

template <class T>
concept ListsScalars = requires(T& t) {
  t.scalars();
};

template <class T>
inline constexpr bool kIsList = false;
template <class T, std::size_t n>
inline constexpr bool kIsList<std::array<T, n>> = true;
template <class T, class A>
inline constexpr bool kIsList<std::vector<T, A>> = true;

template <class T>
void joinInto(T& into, T& other) {
  if constexpr (std::is_same_v<T, Bounded> || std::is_same_v<T, IntRange>) {
    into = join(into, other);
  } else if constexpr (kIsList<T>) {
    if (into.size() != other.size()) throwPlainDiffers();
    for (std::size_t i = 0; i < into.size(); ++i) joinInto(into[i], other[i]);
  } else if constexpr (ListsScalars<T>) {
    auto a = into.scalars(), b = other.scalars();
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      (joinInto(std::get<i>(a), std::get<i>(b)), ...);
    }
    (std::make_index_sequence<std::tuple_size_v<decltype(a)>>());
  } else {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>,
                  "explore: a result struct needs `auto scalars() { return std::tie(...); }`");
    if (into != other) throwPlainDiffers();
  }
}

template <class T, class F>
void forEachBound(T& result, const F& f) {
  if constexpr (std::is_same_v<T, Bounded> || std::is_same_v<T, IntRange>) {
    f(result);
  } else if constexpr (kIsList<T>) {
    for (auto& element : result) forEachBound(element, f);
  } else if constexpr (ListsScalars<T>) {
    std::apply([&](auto&... members) { (forEachBound(members, f), ...); }, result.scalars());
  }
}

}  // namespace detail

template <class Model>
auto explore(const Model& model) {
  detail::Trail trail;
  const auto run = [&] {
    const detail::FollowTrail follow(trail);
    return model();
  };
  auto result = run();
  while (trail.advance()) {
    auto other = run();
    detail::joinInto(result, other);
  }
  const Flags flags = trail.flags();
  const bool overflowed = trail.overflowed();
  detail::forEachBound(result, [&](auto& bound) {
    if (overflowed) bound = withoutLimits(bound, kAmbiguous | kNotJudged);
    bound.flags |= flags & kFromConditions;
  });
  return result;
}

}  // namespace gnomon

#endif
