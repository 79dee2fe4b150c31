// SPDX-License-Identifier: MIT
// Where OpenEXR writes to and reads from.
#ifndef FARLIGHT_CLIENT_OUTPUT_EXR_STREAM_HPP
#define FARLIGHT_CLIENT_OUTPUT_EXR_STREAM_HPP

#include <OpenEXR/Iex.h>
#include <OpenEXR/ImfIO.h>

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <vector>

// The library seeks back at the end, to fill in where the lines are.
class memory_stream : public Imf::OStream
{
  public:
    memory_stream() : Imf::OStream("image.exr")
    {
    }
    void write(const char bytes[], int count) override
    {
        const size_t end = at + static_cast<size_t>(count);
        file.resize(std::max(file.size(), end));
        std::copy_n(bytes, count, file.begin() + static_cast<std::ptrdiff_t>(at));
        at = end;
    }
    uint64_t tellp() override
    {
        return at;
    }
    void seekp(uint64_t position) override
    {
        at = position;
    }
    std::vector<uint8_t> file;

  private:
    size_t at = 0;
};

// A file that is open. The descriptor stays the caller's.
class descriptor_stream : public Imf::IStream
{
  public:
    explicit descriptor_stream(int fd) : Imf::IStream("file"), from(fd)
    {
    }
    bool read(char bytes[], int count) override
    {
        for (int got = 0; got < count;) {
            const ssize_t more =
                pread(from, bytes + got, static_cast<size_t>(count - got), static_cast<off_t>(at));
            if (more <= 0)
                throw IEX_NAMESPACE::InputExc("it is cut off");
            got += static_cast<int>(more);
            at += static_cast<uint64_t>(more);
        }
        return true;
    }
    uint64_t tellg() override
    {
        return at;
    }
    void seekg(uint64_t position) override
    {
        at = position;
    }

  private:
    int from;
    uint64_t at = 0;
};

#endif
