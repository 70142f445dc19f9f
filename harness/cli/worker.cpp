#include "harness/isolate/worker.h"

#include "harness/cli/commands.h"

namespace gnomon {

int worker(const std::string& task) {
  serve(workerTask(task));
  return kGood;
}

}  // namespace gnomon
