// Readback without waiting: order, what is in flight, what is refused, transfers meanwhile. Every
// test also fails for a validation message.
// Not covered: a device that is lost while frames are in flight.
#include "harness/vulkan/readback.h"

#include <cstring>
#include <thread>

#include "harness/error.h"
#include "tests/harness/drawing.h"

namespace gnomon {
namespace {

using Clock = std::chrono::steady_clock;

constexpr BindingSlot kState{0, 0};
constexpr std::size_t kBytes = 64 * sizeof(std::uint32_t);  // that are looked at

/// Fills 64 words with what is pushed, after work that takes as long as there are groups.
ProgramDescription filling() {
  ProgramDescription description;
  description.spirv = compileText(R"(#version 450
    layout(local_size_x = 64) in;
    layout(push_constant) uniform Push { uint value; uint rounds; };
    layout(set = 0, binding = 0) buffer State { uint state[]; };
    void main() {
      uint s = gl_GlobalInvocationID.x;
      for (uint i = 0; i < rounds; ++i) s = s * 1664525u + (s >> 3);
      state[gl_LocalInvocationIndex] = value;
      state[64 + gl_LocalInvocationIndex] = s;  // else nobody would compute it
    })");
  description.slots = {kState};
  description.pushBytes = 8;
  return description;
}

std::uint32_t firstOf(const GpuReadback::Frame& frame) {
  std::uint32_t value = 0;
  std::memcpy(&value, frame.bytes.data(), sizeof value);
  return value;
}

class ReadbackTest : public DrawingTest {
 protected:
  void SetUp() override {
    program = gpu->build(filling());
    state = gpu->allocate(2 * kBytes);
  }

  Dispatch filled(std::uint32_t value) {
    Dispatch dispatch;
    dispatch.program = &program;
    dispatch.buffers = {{kState, &state}};
    dispatch.push = pushed(std::array<std::uint32_t, 2>{value, 0});
    return dispatch;
  }

  /// Half a second and more on lavapipe; the largest GPU needs a tenth. Groups instead of rounds:
  /// lavapipe cuts an invocation short after 65,535 of them.
  Dispatch slow(std::uint32_t value) {
    Dispatch dispatch = filled(value);
    dispatch.push = pushed(std::array<std::uint32_t, 2>{value, 65000});
    if (gpu->info().software)
      dispatch.groups = {300, 1, 1};
    else
      dispatch.groups = {60000, 4, 1};
    return dispatch;
  }

  bool submit(GpuReadback& readback, const Dispatch& dispatch) {
    const Work work = &dispatch;
    const GpuCopy copy{&state, 0, kBytes};
    return readback.submit(std::span(&work, 1), std::span(&copy, 1));
  }

  static GpuReadback::Frame next(GpuReadback& readback) {
    const auto start = Clock::now();
    while (Clock::now() - start < kDrawLimit) {
      if (auto frame = readback.poll()) return std::move(*frame);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ADD_FAILURE() << "no frame came back";
    return {};
  }

  GpuProgram program;
  GpuBuffer state;
};

TEST_F(ReadbackTest, FramesComeBackInOrderWithWhatTheyMade) {
  GpuReadback readback(*gpu, 3, kBytes);
  std::uint32_t sent = 0;
  std::uint64_t after = 0;  // number of the next frame that may come
  const auto start = Clock::now();
  while (after < 40) {
    ASSERT_LT(Clock::now() - start, kDrawLimit) << sent << " frames sent, " << after << " back";
    if (submit(readback, filled(1000 + sent))) ++sent;
    const auto frame = readback.poll();
    if (!frame) continue;
    ASSERT_GE(frame->number, after);
    ASSERT_LT(frame->number, sent);
    EXPECT_EQ(firstOf(*frame), 1000 + frame->number);
    EXPECT_EQ(frame->bytes.size(), kBytes);
    EXPECT_EQ(frame->times.size(), 1u);
    after = frame->number + 1;
  }
}

TEST_F(ReadbackTest, NothingComesOfAReadbackWithoutFrames) {
  GpuReadback readback(*gpu, 2, kBytes);
  EXPECT_FALSE(readback.poll());
  ASSERT_TRUE(submit(readback, filled(7)));
  EXPECT_EQ(firstOf(next(readback)), 7u);
  EXPECT_FALSE(readback.poll()) << "the same frame twice";
}

TEST_F(ReadbackTest, NeitherSubmitNorPollWaitsForALongDispatch) {
  GpuReadback readback(*gpu, 1, kBytes);
  const auto start = Clock::now();
  ASSERT_TRUE(submit(readback, slow(5)));
  EXPECT_FALSE(readback.poll());
  EXPECT_FALSE(submit(readback, filled(6))) << "one slot, one frame in flight";
  const auto asked = Clock::now() - start;
  EXPECT_EQ(firstOf(next(readback)), 5u);
  const auto done = Clock::now() - start;
  EXPECT_LT(asked * 4, done) << "a call took a good part of the dispatch's time";
  EXPECT_TRUE(submit(readback, filled(6)));
  EXPECT_EQ(firstOf(next(readback)), 6u);
}

TEST_F(ReadbackTest, OnlyTheNewestOfSeveralFramesIsGiven) {
  GpuReadback readback(*gpu, 3, kBytes);
  for (const std::uint32_t value : {1u, 2u, 3u}) ASSERT_TRUE(submit(readback, filled(value)));
  EXPECT_FALSE(submit(readback, filled(4))) << "a fourth frame in flight";
  gpu->run(std::vector<Dispatch>{filled(9)}, kDrawLimit);  // waits for all of them
  const auto frame = readback.poll();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->number, 2u);
  EXPECT_EQ(firstOf(*frame), 3u);
  EXPECT_TRUE(submit(readback, filled(4)));
  EXPECT_EQ(next(readback).number, 3u) << "what was refused has no number";
}

// Mapped memory must not be touched while a frame may use it.
TEST_F(ReadbackTest, TransfersTakeTheirTurnBehindFramesInFlight) {
  GpuReadback readback(*gpu, 2, kBytes);
  ASSERT_TRUE(submit(readback, slow(5)));
  Words values(64);
  gpu->download(state, 0, std::as_writable_bytes(std::span(values)));
  EXPECT_EQ(values, Words(64, 5));
  ASSERT_TRUE(submit(readback, slow(6)));
  const Words sevens(64, 7);
  gpu->upload(state, 0, std::as_bytes(std::span(sevens)));
  EXPECT_EQ(firstOf(next(readback)), 6u);
  gpu->download(state, 0, std::as_writable_bytes(std::span(values)));
  EXPECT_EQ(values, sevens);
}

TEST_F(ReadbackTest, CopiesStandOneBehindTheOther) {
  GpuReadback readback(*gpu, 1, 24);
  const GpuBuffer numbers = uploaded<std::uint32_t>(*gpu, {1, 2, 3, 4, 5});
  const GpuCopy copies[] = {{&numbers, 12, 8}, {&numbers, 0, 0}, {&numbers, 0, 4}};
  ASSERT_TRUE(readback.submit({}, copies));
  const GpuReadback::Frame frame = next(readback);
  EXPECT_EQ(frame.bytes, pushed(std::array<std::uint32_t, 3>{4, 5, 1}));
  EXPECT_TRUE(frame.times.empty());
}

TEST_F(ReadbackTest, CopiesThatDoNotFitAreProgrammingErrors) {
  GpuReadback readback(*gpu, 1, 16);
  const auto said = [&]<typename Error>(const GpuCopy& copy, Error) {
    return thrownBy<Error>([&] { readback.submit({}, std::span(&copy, 1)); });
  };
  EXPECT_EQ(said({&state, 0, 20}, std::logic_error("")), "copies of 20 bytes for a readback of 16");
  EXPECT_EQ(said({&state, 2 * kBytes - 4, 8}, std::out_of_range("")),
            "bytes 508 to 516 of a GPU buffer of 512 bytes");
  EXPECT_EQ(thrownBy<std::logic_error>([] { GpuReadback(*gpu, 0, 16); }),
            "a readback without slots");
}

TEST_F(ReadbackTest, AReadbackThatGoesWaitsForItsFrames) {
  auto readback = std::make_unique<GpuReadback>(*gpu, 2, kBytes);
  ASSERT_TRUE(submit(*readback, slow(5)));
  ASSERT_TRUE(submit(*readback, filled(6)));
  readback.reset();
  Words values(64);
  gpu->download(state, 0, std::as_writable_bytes(std::span(values)));
  EXPECT_EQ(values, Words(64, 6));
}

// Last of its suite: the device it gives up keeps the cores busy.
TEST_F(ReadbackTest, ARunThatPassesItsLimitBehindAFrameEndsTheDeviceWithoutWaiting) {
  Gpu hung(Gpu::Options{});
  const GpuProgram other = hung.build(filling());
  const GpuBuffer target = hung.allocate(2 * kBytes);
  GpuReadback readback(hung, 2, kBytes);
  Dispatch dispatch = slow(5);
  dispatch.program = &other;
  dispatch.buffers = {{kState, &target}};
  const Work work = &dispatch;
  ASSERT_TRUE(readback.submit(std::span(&work, 1), {}));
  EXPECT_THROW(hung.run(std::span(&work, 1), std::chrono::milliseconds(50)), GpuError);
  EXPECT_FALSE(hung.alive());
  EXPECT_THROW(readback.submit(std::span(&work, 1), {}), GpuError);
}

}  // namespace
}  // namespace gnomon
